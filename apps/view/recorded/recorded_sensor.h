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

#include "apps/dataset/dataset_reader.h"
#include "apps/scene/readers/scene_reader.h"
#include "core/geometry/pose.h"
#include "core/geometry/trajectory.h"
#include "sensors/camera/lens/lens.h"
#include "sensors/lidar/lidar_spec.h"

namespace groundray {

/// Properties of a recorded lidar.
struct LidarFacts {
  LidarSpec spec;         ///< simulated spec, except for the sun, if `is_whole`; else its file's
  bool is_whole = false;  ///< false: the scene's changes to the lidar could not be read
};

/// Properties of a recorded camera.
struct CameraFacts {
  Lens lens;
  double exposure_s = 0, row_s = 0;

  /// Returns the time at which a row is half exposed, relative to the image's stamp.
  std::chrono::nanoseconds middle_of_row(double row_px) const;
};

/// Lidar or camera of a dataset.
struct RecordedSensor {
  std::string name;
  std::string model;  ///< name for display: "Velodyne VLP-16"
  SensorKind kind = SensorKind::Lidar;
  Trajectory X_DS;                    ///< X_DC for a camera
  Pose X_BS;                          ///< mount; X_BC for a camera
  std::vector<RecordedFrame> frames;  ///< frames by number; for cameras, `file` lacks a suffix
  std::size_t pending = 0;            ///< number of frames that are not recorded yet
  std::chrono::nanoseconds lasts{0};  ///< approximate duration of a frame
  LidarSpec::Points points = LidarSpec::Points::AsFired;  ///< frame of a scan's x, y, z
  std::optional<LidarFacts> lidar;    ///< lidars only, if the dataset has the spec
  std::optional<CameraFacts> camera;  ///< cameras only
};

/// Returns a sensor's pose at a time, clamped to the ends of its trajectory.
inline Pose pose_at(const RecordedSensor& sensor, std::chrono::nanoseconds time) {
  return sensor.X_DS.pose_at(std::clamp(time, sensor.X_DS.begin_time(), sensor.X_DS.end_time()));
}

/// Names of the numbers in a dataset's columns and channels.
struct RecordedNames {
  using Objects = DatasetHead::Objects;
  std::vector<std::string> materials;           ///< the first has number 1
  std::vector<Objects> objects;                 ///< entries of the scene file
  std::map<std::uint32_t, std::string> labels;  ///< names by label; several are comma-separated
};

/// Metadata of a dataset.
struct RecordedRun {
  Georeference georeference;
  std::vector<RecordedSensor> sensors;  ///< lidars, then cameras
  RecordedNames names;
};

/// Reads dataset.yaml, and each sensor's trajectory and calibration, but no scans or images.
/// @throws Error naming file, line and rule of each fault.
RecordedRun read_recorded_run(const std::filesystem::path& dataset);

}  // namespace groundray
