#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/dataset/dataset_listing.h"
#include "core/mesh_io.h"
#include "core/trajectory.h"
#include "sensors/lidar_spec.h"

namespace groundray {

/// A lidar's scans in a dataset.
struct RecordedLidar {
  std::string name;
  Trajectory X_DS;
  LidarSpec::Points points = LidarSpec::Points::AsFired;
  double range_noise_sigma_m = 0;     ///< besides what light brings
  std::vector<RecordedFrame> frames;  ///< by number
  std::size_t pending = 0;            ///< frames that are not there yet
};

/// What a dataset folder tells of its lidars (docs/formats.md).
struct RecordedDataset {
  Georeference georeference;
  std::vector<RecordedLidar> lidars;
};

/// Reads dataset.yaml, and poses and calibration of each lidar; scans are not looked into.
/// @throws Error naming file, line and rule of each fault.
RecordedDataset read_dataset(const std::filesystem::path& folder);

}  // namespace groundray
