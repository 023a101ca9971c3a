#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/dataset_listing.h"
#include "core/pose.h"
#include "core/trajectory.h"
#include "sensors/camera/lens.h"
#include "sensors/lidar_spec.h"
#include "sensors/spec_io.h"

namespace groundray {

/// What a dataset tells of a lidar besides its scans.
struct LidarFacts {
  LidarSpec spec;         ///< as simulated but for the sun, if `is_whole`; else as its file says
  bool is_whole = false;  ///< false: what the scene changed of it could not be read again
};

/// What a dataset tells of a camera besides its images.
struct CameraFacts {
  Lens lens;
  double exposure_s = 0, row_s = 0;

  /// Returns when a row is half exposed, after the image's stamp.
  std::chrono::nanoseconds middle_of_row(double row_px) const;
};

/// A lidar or a camera of a dataset.
struct RecordedSensor {
  std::string name;
  std::string model;  ///< for people: "Velodyne VLP-16"
  SensorKind kind = SensorKind::Lidar;
  Trajectory X_DS;                    ///< of a camera X_DC
  Pose X_BS;                          ///< how it is mounted; of a camera X_BC
  std::vector<RecordedFrame> frames;  ///< by number; of cameras `file` is without an ending
  std::size_t pending = 0;            ///< frames that are not there yet
  std::chrono::nanoseconds lasts{0};  ///< a frame, about
  LidarSpec::Points points = LidarSpec::Points::AsFired;  ///< the frame of a scan's x, y, z
  std::optional<LidarFacts> lidar;                        ///< of lidars, if the dataset tells
  std::optional<CameraFacts> camera;                      ///< of cameras
};

/// Returns a sensor's pose at a time; before and after its path, that at the nearer end.
inline Pose pose_at(const RecordedSensor& sensor, std::chrono::nanoseconds time) {
  return sensor.X_DS.pose_at(std::clamp(time, sensor.X_DS.begin_time(), sensor.X_DS.end_time()));
}

/// What the numbers in a dataset's columns and channels mean.
struct RecordedNames {
  struct Objects {
    std::string name;
    std::uint16_t label = 0;
    std::uint32_t first = 1, count = 0;  ///< instances
  };
  std::vector<std::string> materials;           ///< the first is number 1
  std::vector<Objects> objects;                 ///< entries of the scene
  std::map<std::uint32_t, std::string> labels;  ///< names of what has that class, with commas
};

/// All that a dataset folder tells of itself.
struct RecordedRun {
  Georeference georeference;
  std::vector<RecordedSensor> sensors;  ///< lidars, then cameras
  RecordedNames names;
};

/// Reads dataset.yaml, and path and calibration of each sensor; scans and images are not looked
/// into.
/// @throws Error naming file, line and rule of each fault.
RecordedRun read_recorded_run(const std::filesystem::path& dataset);

}  // namespace groundray
