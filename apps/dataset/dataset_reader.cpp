#include "apps/dataset/dataset_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include "apps/dataset/dataset_text.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"
#include "core/io/tum_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using yaml::Need;
using FrameLists = std::map<std::string, DatasetListing::Frames>;

constexpr yaml::Rule stamp_rule{[](double value) { return std::abs(value) < 9e9; },
                                "must be within 9e9 s"};  // range of nanoseconds

// ----- the head

void read_georeference(yaml::Map& root, Georeference& georeference) {
  std::array<double, 3> origin_m{};
  root.read_numbers("origin_w_m", Need::Required, origin_m);
  georeference.origin_w_m = {origin_m[0], origin_m[1], origin_m[2]};
  if (const auto* node = root.find("crs", Need::Optional)) georeference.crs_name = node->text;
  if (const auto* node = root.find("crs_wkt", Need::Optional)) georeference.crs_wkt = node->text;
}

void read_names(yaml::Map& root, yaml::Faults& faults, DatasetHead& head) {
  root.read_text("scene", Need::Optional, head.scene);
  for (const yaml::Node& material : root.list("materials", Need::Optional))
    head.materials.push_back(material.text);
  for (const yaml::Node& node : root.list("objects", Need::Optional)) {
    yaml::Map entry(node, "objects", faults);
    DatasetHead::Objects& objects = head.objects.emplace_back();
    entry.read_text("name", Need::Required, objects.name);
    entry.read_whole("label", Need::Required, objects.label);
    entry.read_whole("first_instance", Need::Required, objects.first);
    entry.read_whole("count", Need::Required, objects.count);
    entry.close_partly();
  }
}

// Reports a fault unless a sensor's name is valid as the name of a file.
void check_letters(const yaml::Node& node, std::string_view key, const std::string& name,
                   yaml::Faults& faults) {
  constexpr std::string_view letters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
  if (name.find_first_not_of(letters) != std::string::npos) {
    faults.add(node, key,
               "is {}, but is part of file names: only letters, digits, '_' and '-' are permitted",
               yaml::shown(node));
  }
}

void check_name(const yaml::Node& node, const std::string& name, std::set<std::string>& names,
                yaml::Faults& faults) {
  check_letters(node, "name", name, faults);
  if (!names.insert(name).second)
    faults.add(node, "name", "'{}' is taken by an earlier sensor: names must differ", name);
}

// Reports a fault if the number of listed frames differs from the sensor's own count.
void check_count(const yaml::Node& node, const DatasetHead::Sensor& sensor, const FrameLists& lists,
                 yaml::Faults& faults) {
  const auto list = lists.find(sensor.name);
  const std::size_t listed =
      list == lists.end() ? 0 : list->second.done.size() + list->second.pending;
  if (listed == sensor.frames) return;
  faults.add(node, "frames", "{} has {} frames, but {} are listed: was the file truncated?",
             sensor.name, sensor.frames, listed);
}

void read_sensor(const yaml::Node& node, HeadUse use, const FrameLists& lists,
                 std::set<std::string>& names, yaml::Faults& faults, DatasetHead& head) {
  yaml::Map map(node, "sensors", faults);
  DatasetHead::Sensor sensor;
  const bool is_of_run = use == HeadUse::Run;
  const yaml::Node* const name = map.read_text("name", Need::Required, sensor.name);
  if (name != nullptr) check_name(*name, sensor.name, names, faults);
  if (is_of_run) {
    sensor.kind = "stereo";  // needs no more keys, if the kind is invalid
    map.read_choice<std::string>("kind", Need::Required, sensor.kind,
                                 {{"lidar", "lidar"}, {"camera", "camera"}, {"stereo", "stereo"}});
  } else {
    map.read_text("kind", Need::Required, sensor.kind);
  }
  if (sensor.kind != "stereo") {
    const yaml::Node* const count =
        map.read_whole("frames", is_of_run ? Need::Required : Need::Optional, sensor.frames);
    if (is_of_run)
      map.read_text("model", Need::Optional, sensor.model);
    else if (count != nullptr)
      check_count(*count, sensor, lists, faults);
    head.sensors.push_back(std::move(sensor));
  } else if (!is_of_run) {
    DatasetHead::Pair& pair = head.pairs.emplace_back(DatasetHead::Pair{sensor.name, {}, {}});
    for (const auto& [key, camera] : {std::pair("left", &pair.left), {"right", &pair.right}}) {
      const yaml::Node* const given = map.read_text(key, Need::Required, *camera);
      if (given != nullptr) check_letters(*given, key, *camera, faults);
    }
  }
  map.close_partly();
}

// @param lists  listed frames, with which the counts of sensors must agree unless `use` is Run.
DatasetHead read_head(yaml::Map& root, HeadUse use, const FrameLists& lists, yaml::Faults& faults) {
  DatasetHead head;
  yaml::check_version(root, "groundray_dataset", faults);
  if (use == HeadUse::Run) {
    root.read_text("version", Need::Required, head.version);
    root.read_whole("seed", Need::Required, head.seed);
  } else {
    read_georeference(root, head.georeference);
  }
  if (use == HeadUse::Names) read_names(root, faults, head);
  std::set<std::string> names;
  for (const yaml::Node& sensor : root.list("sensors", Need::Required))
    read_sensor(sensor, use, lists, names, faults, head);
  root.close_partly();
  faults.throw_if_any();
  return head;
}

// ----- frames

void add_frame(const FrameEntry& entry, FrameLists& lists) {
  DatasetListing::Frames& frames = lists[entry.sensor];
  if (entry.is_done)
    frames.done.push_back({.number = entry.frame, .stamp = entry.stamp, .file = {}});
  else
    ++frames.pending;
}

void read_frame(const yaml::Node& node, yaml::Faults& faults, FrameLists& lists) {
  yaml::Map frame(node, "frames", faults);
  FrameEntry entry;
  std::uint64_t number = 0;
  double stamp_s = 0;
  frame.read_text("sensor", Need::Required, entry.sensor);
  frame.read_whole("frame", Need::Required, number);
  frame.read_number("stamp_s", Need::Required, stamp_s, stamp_rule);
  frame.read_choice("state", Need::Required, entry.is_done, {{"done", true}, {"pending", false}});
  frame.close_partly();
  entry.frame = static_cast<std::int64_t>(number);
  entry.stamp = time_of(stamp_s);
  add_frame(entry, lists);
}

// Returns the part before the frames, and adds the frames to `lists`, if the file is as the
// generator writes it (it may list any number of frames); nothing for any other file.
std::optional<yaml::Node> read_generated(const fs::path& folder, FrameLists& lists) {
  try {
    DatasetText text(folder);
    while (const auto line = text.next_entry()) {
      const auto entry = parse_entry(*line);
      if (!entry) return std::nullopt;
      add_frame(*entry, lists);
    }
    return text.is_intact() ? std::optional(yaml::parse(text.header(), folder / dataset_file))
                            : std::nullopt;
  } catch (const Error&) {
    return std::nullopt;  // the general reader reports the fault
  }
}

// ----- lidars

// Reads the keys of a lidar's calibration that are needed to use its points; ignores the others.
void read_calibration(const fs::path& path, RecordedLidar& lidar) {
  yaml::Faults faults(path);
  const yaml::Node node = yaml::parse(yaml::read_file(path), path);
  yaml::Map root(node, "", faults);
  root.read_number("range_noise_sigma_m", Need::Required, lidar.range_noise_sigma_m,
                   yaml::not_negative);
  root.read_choice(
      "points", Need::Optional, lidar.points,
      {{"as_fired", LidarSpec::Points::AsFired}, {"at_stamp", LidarSpec::Points::AtStamp}});
  root.close_partly();
  faults.throw_if_any();
}

RecordedLidar read_lidar(const fs::path& folder, const std::string& name,
                         const DatasetListing& listing) {
  RecordedLidar lidar{.name = name, .X_DS = read_tum(folder / "poses" / (name + ".tum"))};
  read_calibration(folder / "calibration" / (name + ".yaml"), lidar);
  DatasetListing::Frames frames = listing.frames_of(name);
  lidar.frames = std::move(frames.done);
  lidar.pending = frames.pending;
  for (RecordedFrame& frame : lidar.frames)
    frame.file = folder / "lidar" / name / fmt::format("{:06}{}", frame.number, scan_suffix);
  return lidar;
}

}  // namespace

std::vector<std::string> DatasetHead::names_of(std::string_view kind) const {
  std::vector<std::string> names;
  for (const Sensor& sensor : sensors) {
    if (sensor.kind == kind) names.push_back(sensor.name);
  }
  return names;
}

DatasetListing::Frames DatasetListing::frames_of(const std::string& sensor) const {
  const auto found = frames.find(sensor);
  return found == frames.end() ? Frames{} : found->second;
}

DatasetListing read_listing(const fs::path& folder, HeadUse use) {
  const fs::path path = folder / dataset_file;
  yaml::Faults faults(path);
  DatasetListing listing;
  const auto generated = read_generated(folder, listing.frames);
  const yaml::Node node = generated ? *generated : yaml::parse(yaml::read_file(path), path);
  yaml::Map root(node, "", faults);
  if (!generated) {
    listing.frames.clear();
    for (const yaml::Node& frame : root.list("frames", Need::Required))
      read_frame(frame, faults, listing.frames);
  }
  listing.head = read_head(root, use, listing.frames, faults);
  for (auto& [sensor, frames] : listing.frames)
    std::ranges::sort(frames.done, {}, &RecordedFrame::number);
  return listing;
}

RecordedDataset read_dataset(const fs::path& folder) {
  const DatasetListing listing = read_listing(folder);
  RecordedDataset dataset{.georeference = listing.head.georeference, .lidars = {}};
  for (const std::string& name : listing.head.names_of("lidar"))
    dataset.lidars.push_back(read_lidar(folder, name, listing));
  return dataset;
}

std::optional<std::size_t> DatasetSummary::number_of(std::string_view sensor) const {
  const auto found = std::ranges::find(sensors, sensor, &Sensor::name);
  if (found == sensors.end()) return std::nullopt;
  return static_cast<std::size_t>(found - sensors.begin());
}

std::optional<std::string> DatasetSummary::stem_of(const FrameEntry& entry) const {
  const auto number = number_of(entry.sensor);
  if (!number) return std::nullopt;
  return fmt::format("{}/{}/{:06}", sensors[*number].kind, entry.sensor, entry.frame);
}

// The numbers of chosen frames are not consecutive from 0: their end is unknown here.
bool DatasetSummary::has(const Sensor& sensor, std::int64_t frame) const noexcept {
  if (frame < 0) return false;
  if (text_of(part.choice).empty()) return frame < sensor.frames;
  return part.choice.frames.contains(static_cast<std::size_t>(frame));
}

void DatasetSummary::add(const FrameEntry& entry) {
  const auto number = number_of(entry.sensor);
  if (!number) return;
  Sensor& sensor = sensors[*number];
  if (!has(sensor, entry.frame)) return;
  if (part.shard &&
      !part.shard->has(static_cast<std::uint32_t>(*number), entry.frame, sensor.frames))
    return;
  if (!sensor.counted.insert(entry.frame).second) return;
  ++done;
  ++sensor.done;
  for (const ProductSum& file : entry.files) sensor.bytes += file.sum.bytes;
}

DatasetSummary read_summary(const fs::path& folder) {
  DatasetText text(folder);
  const fs::path path = folder / dataset_file;
  yaml::Faults faults(path);
  const yaml::Node node = yaml::parse(text.header(), path);
  yaml::Map root(node, "", faults);
  DatasetHead head = read_head(root, HeadUse::Run, {}, faults);
  DatasetSummary summary{.version = head.version,
                         .seed = head.seed,
                         .part = {text.shard(), text.choice()},
                         .sensors = {}};
  for (DatasetHead::Sensor& sensor : head.sensors) {
    const auto number = static_cast<std::uint32_t>(summary.sensors.size());
    const std::int64_t frames = sensor.frames;
    const auto asked_for = static_cast<std::size_t>(
        summary.part.shard ? summary.part.shard->share(number, frames) : frames);
    summary.asked_for += asked_for;
    summary.sensors.push_back({.name = std::move(sensor.name),
                               .kind = std::move(sensor.kind),
                               .model = std::move(sensor.model),
                               .frames = frames,
                               .asked_for = asked_for});
  }
  while (const auto line = text.next_entry()) {
    const auto entry = parse_entry(*line);
    if (entry && entry->is_done) summary.add(*entry);
  }
  return summary;
}

std::chrono::nanoseconds time_of(double time_s) {
  return std::chrono::nanoseconds(std::llround(time_s * 1e9));
}

}  // namespace groundray
