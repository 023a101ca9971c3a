#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/mesh_io.h"
#include "core/trajectory.h"
#include "sensors/lidar_spec.h"

namespace groundray {

/// A lidar's scans in a dataset.
struct RecordedLidar {
  struct Frame {
    std::int64_t number = 0;
    std::chrono::nanoseconds stamp{0};
    std::filesystem::path file;
  };

  std::string name;
  Trajectory X_DS;
  LidarSpec::Points points = LidarSpec::Points::AsFired;
  double range_noise_sigma_m = 0;  ///< besides what light brings
  std::vector<Frame> frames;       ///< those that are there, by number
  std::size_t pending = 0;         ///< frames that are not there yet
};

/// What a dataset folder tells of its lidars (docs/formats.md).
struct RecordedDataset {
  Georeference georeference;
  std::vector<RecordedLidar> lidars;
};

/// Reads dataset.yaml, and poses and calibration of each lidar; scans are not looked into.
/// @throws Error naming file, line and rule of each fault; or if there is no lidar.
RecordedDataset read_dataset(const std::filesystem::path& folder);

}  // namespace groundray
