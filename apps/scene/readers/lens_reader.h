#pragma once

#include <filesystem>
#include <glm/vec2.hpp>

#include "apps/scene/yaml_reader.h"
#include "sensors/camera/lens/lens_models.h"

// Reader of the lens of a camera file, private to this library.
namespace groundray {

/// Lens, and the size of its image if it is from a calibration that states it, else 0.
struct CameraFileLens {
  LensModel model;
  glm::ivec2 size_px{0};
};

/// Reads the key `lens` of a camera file: a model with its parameters, or a calibration.
/// @param path  path of the camera file; calibrations are relative to its folder.
CameraFileLens read_lens(const yaml::Node& node, const std::filesystem::path& path,
                         yaml::Faults& faults);

}  // namespace groundray
