#include "apps/dataset/dataset_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/dataset/dataset_text.h"
#include "sensors/yaml_reader.h"

namespace groundray {
namespace {

using yaml::Need;

void read_sensor(const yaml::Node& node, yaml::Faults& faults, DatasetSummary& summary) {
  yaml::Map map(node, "sensors", faults);
  DatasetSummary::Sensor sensor;
  map.read_text("name", Need::Required, sensor.name);
  map.read_text("kind", Need::Required, sensor.kind);
  if (sensor.kind != "stereo") {
    std::uint32_t frames = 0;
    map.read_whole("frames", Need::Required, frames);
    map.read_text("model", Need::Optional, sensor.model);
    sensor.frames = frames;
    const auto number = static_cast<std::uint32_t>(summary.sensors.size());
    for (std::int64_t frame = 0; frame < sensor.frames; ++frame)
      if (!summary.shard || summary.shard->has(number, frame, sensor.frames)) ++sensor.asked_for;
    summary.asked_for += sensor.asked_for;
    summary.sensors.push_back(std::move(sensor));
  }
  map.close_partly();
}

}  // namespace

std::optional<std::string> DatasetSummary::stem_of(const FrameEntry& entry) const {
  const auto sensor = std::ranges::find(sensors, entry.sensor, &Sensor::name);
  if (sensor == sensors.end()) return std::nullopt;
  return fmt::format("{}/{}/{:06}", sensor->kind, sensor->name, entry.frame);
}

DatasetSummary read_summary(const std::filesystem::path& folder) {
  DatasetText text(folder);
  const std::filesystem::path path = folder / dataset_file;
  yaml::Faults faults(path);
  const yaml::Node node = yaml::parse(text.header(), path);
  yaml::Map root(node, "", faults);
  yaml::check_version(root, "groundray_dataset", faults);
  DatasetSummary summary{.version = {}, .shard = text.shard(), .sensors = {}};
  root.read_text("version", Need::Required, summary.version);
  root.read_whole("seed", Need::Required, summary.seed);
  for (const yaml::Node& sensor : root.list("sensors", Need::Required))
    read_sensor(sensor, faults, summary);
  root.close_partly();
  faults.throw_if_any();
  while (const auto line = text.next_entry()) {
    const auto entry = parse_entry(*line);
    if (!entry || !entry->is_done) continue;
    ++summary.done;
    const auto sensor =
        std::ranges::find(summary.sensors, entry->sensor, &DatasetSummary::Sensor::name);
    if (sensor == summary.sensors.end()) continue;
    ++sensor->done;
    for (const ProductSum& file : entry->files) sensor->bytes += file.sum.bytes;
  }
  return summary;
}

}  // namespace groundray
