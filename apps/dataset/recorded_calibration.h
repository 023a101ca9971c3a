#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <string>
#include <string_view>

#include "core/pose.h"
#include "sensors/camera/lens_models.h"
#include "sensors/yaml_reader.h"

namespace groundray {

/// What calibration/<camera>.yaml of a dataset tells (docs/formats.md).
struct RecordedCalibration {
  std::string model;  ///< for people; may be empty
  Pose X_BC;          ///< how the camera is mounted
  LensModel lens = Pinhole{};
  glm::ivec2 size_px{0};
  double exposure_s = 0, row_s = 0;
};

/// @throws Error naming file, line and rule of each fault.
RecordedCalibration read_camera_calibration(const std::filesystem::path& path);

/// Reads how a sensor is mounted; at the origin of the platform, if it does not say.
Pose read_mount(yaml::Map& calibration, std::string_view key, yaml::Faults& faults);

}  // namespace groundray
