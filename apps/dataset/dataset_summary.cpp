#include "apps/dataset/dataset_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

#include "apps/dataset/dataset_text.h"
#include "apps/scene/yaml_reader.h"

namespace groundray {
namespace {

using yaml::Need;

enum class Kind { Lidar, Camera, Stereo };

// Reads the name of a sensor or pair, which must be unique and valid as the name of a file.
std::string read_name(yaml::Map& map, std::set<std::string>& names, yaml::Faults& faults) {
  constexpr std::string_view letters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
  std::string name;
  const yaml::Node* const at = map.read_text("name", Need::Required, name);
  if (at == nullptr) return name;
  if (name.find_first_not_of(letters) != std::string::npos) {
    faults.add(*at, "name",
               "is {}, but is part of file names: only letters, digits, '_' and '-' are permitted",
               yaml::shown(*at));
  }
  if (!names.insert(name).second)
    faults.add(*at, "name", "'{}' is taken by an earlier sensor: names must differ", name);
  return name;
}

void summarise_sensor(const yaml::Node& node, yaml::Faults& faults, std::set<std::string>& names,
                      DatasetSummary& summary) {
  yaml::Map map(node, "sensors", faults);
  DatasetSummary::Sensor sensor;
  sensor.name = read_name(map, names, faults);
  Kind kind = Kind::Stereo;
  map.read_choice("kind", Need::Required, kind,
                  {{"lidar", Kind::Lidar}, {"camera", Kind::Camera}, {"stereo", Kind::Stereo}});
  if (kind != Kind::Stereo) {
    sensor.kind = kind == Kind::Lidar ? "lidar" : "camera";
    std::uint32_t frames = 0;
    map.read_whole("frames", Need::Required, frames);
    map.read_text("model", Need::Optional, sensor.model);
    sensor.frames = frames;
    const auto number = static_cast<std::uint32_t>(summary.sensors.size());
    sensor.asked_for = static_cast<std::size_t>(
        summary.shard ? summary.shard->share(number, sensor.frames) : sensor.frames);
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
  std::set<std::string> names;
  for (const yaml::Node& sensor : root.list("sensors", Need::Required))
    summarise_sensor(sensor, faults, names, summary);
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
