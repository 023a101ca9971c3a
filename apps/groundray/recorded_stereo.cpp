#include "apps/groundray/recorded_stereo.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/product_io.h"
#include "sensors/lens_reader.h"
#include "sensors/yaml_reader.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using std::chrono::nanoseconds;
using yaml::Need;

constexpr yaml::Rule stamp_rule{[](double value) { return std::abs(value) < 9e9; },
                                "must be within 9e9 s"};  // what nanoseconds hold

nanoseconds time_of(double time_s) { return nanoseconds(std::llround(time_s * 1e9)); }

// The names of a pair's cameras.
struct PairNames {
  std::string name, left, right;
};

// What dataset.yaml lists.
struct Listing {
  std::vector<std::string> cameras;
  std::vector<PairNames> pairs;
  std::map<std::string, std::vector<RecordedCamera::Frame>> frames;  // by sensor; those done
};

void read_sensor(const yaml::Node& node, yaml::Faults& faults, Listing& listing) {
  yaml::Map sensor(node, "sensors", faults);
  std::string name, kind;
  sensor.read_text("name", Need::Required, name);
  sensor.read_text("kind", Need::Required, kind);
  if (kind == "camera") listing.cameras.push_back(name);
  if (kind != "stereo") return;
  PairNames pair{.name = name};
  sensor.read_text("left", Need::Required, pair.left);
  sensor.read_text("right", Need::Required, pair.right);
  listing.pairs.push_back(std::move(pair));
}

void read_frame(const yaml::Node& node, yaml::Faults& faults, Listing& listing) {
  yaml::Map frame(node, "frames", faults);
  std::string sensor;
  std::uint64_t number = 0;
  double stamp_s = 0;
  bool is_done = false;
  frame.read_text("sensor", Need::Required, sensor);
  frame.read_whole("frame", Need::Required, number);
  frame.read_number("stamp_s", Need::Required, stamp_s, stamp_rule);
  frame.read_choice("state", Need::Required, is_done, {{"done", true}, {"pending", false}});
  if (!is_done) return;
  listing.frames[sensor].push_back(
      {.number = static_cast<std::int64_t>(number), .stamp = time_of(stamp_s)});
}

Listing read_listing(const fs::path& path) {
  yaml::Faults faults(path);
  const yaml::Node node = yaml::parse(yaml::read_file(path), path);
  yaml::Map root(node, "", faults);
  yaml::check_version(root, "groundray_dataset", faults);
  Listing listing;
  for (const yaml::Node& sensor : root.list("sensors", Need::Required))
    read_sensor(sensor, faults, listing);
  for (const yaml::Node& frame : root.list("frames", Need::Required))
    read_frame(frame, faults, listing);
  faults.throw_if_any();
  return listing;
}

void read_calibration(const fs::path& path, RecordedCamera& camera) {
  yaml::Faults faults(path);
  const yaml::Node node = yaml::parse(yaml::read_file(path), path);
  yaml::Map root(node, "", faults);
  std::array<double, 2> size_px{};
  root.read_numbers("size_px", Need::Required, size_px, yaml::positive);
  camera.size_px = {static_cast<int>(size_px[0]), static_cast<int>(size_px[1])};
  root.read_number("exposure_s", Need::Required, camera.exposure_s, yaml::not_negative);
  root.read_number("row_s", Need::Required, camera.row_s, yaml::not_negative);
  if (const yaml::Node* lens = root.find("lens", Need::Required))
    camera.lens = read_lens(*lens, path, faults).model;
  faults.throw_if_any();
}

// The picture that the camera gives, else the light that it was made of.
fs::path image_file(const fs::path& dataset, const std::string& camera, std::int64_t number) {
  const fs::path stem = dataset / "camera" / camera / fmt::format("{:06}", number);
  for (const char* ending : {".png", ".exr"}) {
    fs::path file = stem.string() + ending;
    if (fs::is_regular_file(file)) return file;
  }
  throw Error(
      "{}: there is neither {}.png nor {}.exr, though dataset.yaml says that the image is done: "
      "ask "
      "for the product picture or radiance of the camera",
      dataset.string(), stem.string(), stem.string());
}

RecordedCamera read_camera(const fs::path& dataset, const std::string& name,
                           const Listing& listing) {
  RecordedCamera camera{.name = name,
                        .X_DC = read_tum(dataset / "poses" / (name + ".tum")),
                        .lens = Pinhole{},
                        .frames = {}};
  read_calibration(dataset / "calibration" / (name + ".yaml"), camera);
  const auto frames = listing.frames.find(name);
  if (frames != listing.frames.end()) camera.frames = frames->second;
  for (RecordedCamera::Frame& frame : camera.frames)
    frame.file = image_file(dataset, name, frame.number);
  std::ranges::sort(camera.frames, {}, &RecordedCamera::Frame::number);
  return camera;
}

// The pair that a name or two names of cameras mean.
PairNames pair_named(const std::string& word, const Listing& listing, const fs::path& dataset) {
  const auto pair = std::ranges::find(listing.pairs, word, &PairNames::name);
  if (pair != listing.pairs.end()) return *pair;
  const std::size_t comma = word.find(',');
  std::vector<std::string> names;
  for (const PairNames& each : listing.pairs) names.push_back(each.name);
  if (comma == std::string::npos) {
    throw Error("{}: it has no stereo pair '{}'; it has: {}{}", dataset.string(), word,
                names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")),
                yaml::suggestion(word, names));
  }
  PairNames made{word, word.substr(0, comma), word.substr(comma + 1)};
  for (const std::string* camera : {&made.left, &made.right}) {
    if (std::ranges::find(listing.cameras, *camera) != listing.cameras.end()) continue;
    throw Error("{}: it has no camera '{}' for the stereo pair {}; it has: {}{}", dataset.string(),
                *camera, word, fmt::join(listing.cameras, ", "),
                yaml::suggestion(*camera, listing.cameras));
  }
  return made;
}

}  // namespace

nanoseconds RecordedCamera::middle(const Frame& frame) const {
  return frame.stamp + time_of((exposure_s + row_s * (size_px.y - 1)) / 2);
}

std::vector<RecordedPair> read_stereo_pairs(const fs::path& dataset,
                                            const std::vector<std::string>& names) {
  const Listing listing = read_listing(dataset / "dataset.yaml");
  std::vector<PairNames> wanted = names.empty() ? listing.pairs : std::vector<PairNames>{};
  for (const std::string& name : names) wanted.push_back(pair_named(name, listing, dataset));
  std::vector<RecordedPair> pairs;
  for (const PairNames& pair : wanted) {
    pairs.push_back({.name = pair.name,
                     .cameras = {read_camera(dataset, pair.left, listing),
                                 read_camera(dataset, pair.right, listing)}});
  }
  return pairs;
}

}  // namespace groundray
