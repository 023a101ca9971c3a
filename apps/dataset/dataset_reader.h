#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/dataset/dataset_listing.h"
#include "core/geometry/trajectory.h"
#include "core/io/mesh_io.h"
#include "sensors/lidar/lidar_spec.h"

namespace groundray {

/// Scans of a lidar in a dataset.
struct RecordedLidar {
  std::string name;
  Trajectory X_DS;
  LidarSpec::Points points = LidarSpec::Points::AsFired;
  double range_noise_sigma_m = 0;     ///< standard deviation, without the receiver's noise
  std::vector<RecordedFrame> frames;  ///< sorted by number
  std::size_t pending = 0;            ///< number of frames that are not finished
};

/// Lidars of a dataset folder (docs/reference/formats.md).
struct RecordedDataset {
  Georeference georeference;
  std::vector<RecordedLidar> lidars;
};

/// Reads dataset.yaml, and the poses and calibration of each lidar; does not open the scans.
/// @throws Error naming file, line and rule of each fault.
RecordedDataset read_dataset(const std::filesystem::path& folder);

}  // namespace groundray
