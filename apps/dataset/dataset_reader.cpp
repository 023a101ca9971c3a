#include "apps/dataset/dataset_reader.h"

#include <fmt/format.h>

#include <utility>

#include "apps/scene/yaml_reader.h"
#include "core/io/tum_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using yaml::Need;

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

RecordedDataset read_dataset(const fs::path& folder) {
  const DatasetListing listing = read_listing(folder);
  RecordedDataset dataset{.georeference = listing.georeference, .lidars = {}};
  for (const std::string& name : listing.lidars)
    dataset.lidars.push_back(read_lidar(folder, name, listing));
  return dataset;
}

}  // namespace groundray
