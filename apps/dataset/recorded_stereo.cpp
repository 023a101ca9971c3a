#include "apps/dataset/recorded_stereo.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "apps/dataset/recorded_calibration.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"
#include "core/io/tum_io.h"
#include "core/near_names.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using std::chrono::nanoseconds;

// Returns the camera's picture, or else its radiance image.
fs::path image_file(const fs::path& dataset, const std::string& camera, std::int64_t number) {
  const fs::path stem = dataset / "camera" / camera / fmt::format("{:06}", number);
  for (const char* ending : {".png", ".exr"}) {
    fs::path file = stem.string() + ending;
    std::error_code ignored;
    if (fs::is_regular_file(file, ignored)) return file;
  }
  throw Error(
      "{}: there is neither {}.png nor {}.exr, although dataset.yaml lists the image as done: was "
      "it removed, or is it unreadable? If the scene does not request it, add the product picture "
      "or radiance to the camera",
      dataset.string(), stem.string(), stem.string());
}

RecordedCamera read_camera(const fs::path& dataset, const std::string& name,
                           const DatasetListing& listing) {
  RecordedCalibration told = read_camera_calibration(dataset / "calibration" / (name + ".yaml"));
  RecordedCamera camera{.name = name,
                        .X_DC = read_tum(dataset / "poses" / (name + ".tum")),
                        .lens = std::move(told.lens),
                        .size_px = told.size_px,
                        .exposure_s = told.exposure_s,
                        .row_s = told.row_s,
                        .frames = listing.frames_of(name).done};
  for (RecordedFrame& frame : camera.frames) frame.file = image_file(dataset, name, frame.number);
  return camera;
}

// Returns the pair with that name, or a pair of the two named cameras.
DatasetHead::Pair pair_named(const std::string& word, const DatasetHead& head,
                             const fs::path& dataset) {
  const auto pair = std::ranges::find(head.pairs, word, &DatasetHead::Pair::name);
  if (pair != head.pairs.end()) return *pair;
  const std::size_t comma = word.find(',');
  std::vector<std::string> names;
  for (const DatasetHead::Pair& each : head.pairs) names.push_back(each.name);
  if (comma == std::string::npos) {
    throw Error("{}: it has no stereo pair '{}'; it has: {}{}", dataset.string(), word,
                names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")),
                suggestion(word, names));
  }
  DatasetHead::Pair made{word, word.substr(0, comma), word.substr(comma + 1)};
  const std::vector<std::string> cameras = head.names_of("camera");
  for (const std::string* camera : {&made.left, &made.right}) {
    if (std::ranges::find(cameras, *camera) != cameras.end()) continue;
    throw Error("{}: it has no camera '{}' for the stereo pair {}; it has: {}{}", dataset.string(),
                *camera, word, fmt::join(cameras, ", "), suggestion(*camera, cameras));
  }
  return made;
}

}  // namespace

nanoseconds RecordedCamera::middle(const RecordedFrame& frame) const {
  return frame.stamp + time_of((exposure_s + row_s * (size_px.y - 1)) / 2);
}

std::vector<RecordedPair> read_stereo_pairs(const fs::path& dataset,
                                            const std::vector<std::string>& names) {
  const DatasetListing listing = read_listing(dataset);
  std::vector<DatasetHead::Pair> wanted =
      names.empty() ? listing.head.pairs : std::vector<DatasetHead::Pair>{};
  for (const std::string& name : names) wanted.push_back(pair_named(name, listing.head, dataset));
  std::vector<RecordedPair> pairs;
  for (const DatasetHead::Pair& pair : wanted) {
    pairs.push_back({.name = pair.name,
                     .cameras = {read_camera(dataset, pair.left, listing),
                                 read_camera(dataset, pair.right, listing)}});
  }
  return pairs;
}

}  // namespace groundray
