#include "apps/dataset/dataset_listing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "apps/dataset/dataset_text.h"
#include "apps/dataset/frame_entry.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using yaml::Need;

constexpr yaml::Rule stamp_rule{[](double value) { return std::abs(value) < 9e9; },
                                "must be within 9e9 s"};  // range of nanoseconds

Georeference read_georeference(yaml::Map& root) {
  Georeference georeference;
  std::array<double, 3> origin_m{};
  root.read_numbers("origin_w_m", Need::Required, origin_m);
  georeference.origin_w_m = {origin_m[0], origin_m[1], origin_m[2]};
  const auto read_text = [&](const char* key, std::string& into) {
    if (const yaml::Node* node = root.find(key, Need::Optional)) into = node->text;  // else empty
  };
  read_text("crs", georeference.crs_name);
  read_text("crs_wkt", georeference.crs_wkt);
  return georeference;
}

// Reports a fault if the number of listed frames differs from the sensor's own count.
void check_count(const std::string& name, yaml::Map& sensor, yaml::Faults& faults,
                 const DatasetListing& listing) {
  std::uint64_t count = 0;
  const yaml::Node* node = sensor.read_whole("frames", Need::Optional, count);
  const DatasetListing::Frames frames = listing.frames_of(name);
  const std::size_t listed = frames.done.size() + frames.pending;
  if (node != nullptr && listed != count)
    faults.add(*node, "frames", "{} has {} frames, but {} are listed: was the file truncated?",
               name, count, listed);
}

// Requires the frames to be known.
void read_sensor(const yaml::Node& node, yaml::Faults& faults, DatasetListing& listing) {
  yaml::Map sensor(node, "sensors", faults);
  DatasetListing::Pair pair;
  std::string kind;
  sensor.read_text("name", Need::Required, pair.name);
  sensor.read_text("kind", Need::Required, kind);
  if (kind == "lidar") listing.lidars.push_back(pair.name);
  if (kind == "camera") listing.cameras.push_back(pair.name);
  if (kind == "stereo") {
    sensor.read_text("left", Need::Required, pair.left);
    sensor.read_text("right", Need::Required, pair.right);
    listing.pairs.push_back(std::move(pair));
  } else {
    check_count(pair.name, sensor, faults, listing);
  }
  sensor.close_partly();
}

void read_frame(const yaml::Node& node, yaml::Faults& faults, DatasetListing& listing) {
  yaml::Map frame(node, "frames", faults);
  std::string sensor;
  std::uint64_t number = 0;
  double stamp_s = 0;
  bool is_done = false;
  frame.read_text("sensor", Need::Required, sensor);
  frame.read_whole("frame", Need::Required, number);
  frame.read_number("stamp_s", Need::Required, stamp_s, stamp_rule);
  frame.read_choice("state", Need::Required, is_done, {{"done", true}, {"pending", false}});
  DatasetListing::Frames& frames = listing.frames[sensor];
  if (is_done)
    frames.done.push_back(
        {.number = static_cast<std::int64_t>(number), .stamp = time_of(stamp_s), .file = {}});
  else
    ++frames.pending;
  frame.close_partly();
}

// Returns the part before the frames, and adds the frames to `listing`, if the file is as the
// generator writes it (it may list any number of frames); nothing for any other file.
std::optional<yaml::Node> read_generated(const fs::path& folder, DatasetListing& listing) {
  try {
    DatasetText text(folder);
    while (const auto line = text.next_entry()) {
      const auto entry = parse_entry(*line);
      if (!entry) return std::nullopt;
      DatasetListing::Frames& frames = listing.frames[entry->sensor];
      if (entry->is_done)
        frames.done.push_back({.number = entry->frame, .stamp = entry->stamp, .file = {}});
      else
        ++frames.pending;
    }
    return text.is_intact() ? std::optional(yaml::parse(text.header(), folder / dataset_file))
                            : std::nullopt;
  } catch (const Error&) {
    return std::nullopt;  // the general reader reports the fault
  }
}

}  // namespace

DatasetListing::Frames DatasetListing::frames_of(const std::string& sensor) const {
  const auto found = frames.find(sensor);
  return found == frames.end() ? Frames{} : found->second;
}

DatasetListing read_listing(const fs::path& folder) {
  const fs::path path = folder / dataset_file;
  yaml::Faults faults(path);
  DatasetListing listing;
  const auto generated = read_generated(folder, listing);
  if (!generated) listing.frames.clear();
  const yaml::Node node = generated ? *generated : yaml::parse(yaml::read_file(path), path);
  yaml::Map root(node, "", faults);
  yaml::check_version(root, "groundray_dataset", faults);
  listing.georeference = read_georeference(root);
  if (!generated) {
    for (const yaml::Node& frame : root.list("frames", Need::Required))
      read_frame(frame, faults, listing);
  }
  for (const yaml::Node& sensor : root.list("sensors", Need::Required))
    read_sensor(sensor, faults, listing);
  root.close_partly();
  faults.throw_if_any();
  for (auto& [sensor, frames] : listing.frames)
    std::ranges::sort(frames.done, {}, &RecordedFrame::number);
  return listing;
}

std::string read_run_text(const fs::path& folder) {
  try {
    DatasetText text(folder);
    while (text.next_entry()) {
    }
    if (text.is_intact()) return text.header();
  } catch (const Error&) {
    // Not as the generator writes it: read below as any other file.
  }
  return yaml::read_file(folder / dataset_file);
}

std::chrono::nanoseconds time_of(double time_s) {
  return std::chrono::nanoseconds(std::llround(time_s * 1e9));
}

}  // namespace groundray
