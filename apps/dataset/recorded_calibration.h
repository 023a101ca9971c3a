#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <string>
#include <string_view>

#include "apps/scene/yaml_reader.h"
#include "core/geometry/pose.h"
#include "sensors/camera/lens/lens_models.h"

namespace groundray {

/// Contents of calibration/<camera>.yaml of a dataset (docs/reference/formats.md).
struct RecordedCalibration {
  std::string model;  ///< informative; may be empty
  Pose X_BC;          ///< mount
  LensModel lens = Pinhole{};
  glm::ivec2 size_px{0};
  double exposure_s = 0, row_s = 0;
};

/// Reads the calibration of a camera.
/// @throws Error naming file, line and rule of each fault.
RecordedCalibration read_camera_calibration(const std::filesystem::path& path);

/// Reads the mount of a sensor; the identity if the key is missing.
Pose read_mount(yaml::Map& calibration, std::string_view key, yaml::Faults& faults);

}  // namespace groundray
