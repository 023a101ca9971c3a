#pragma once

#include <filesystem>
#include <glm/vec2.hpp>

#include "sensors/camera/lens_models.h"
#include "sensors/yaml_reader.h"

// How camera files say what lens there is, private to this library.
namespace groundray {

/// A lens, and the size of the image that it is of where a calibration tells, else 0.
struct LensOfFile {
  LensModel model;
  glm::ivec2 size_px{0};
};

/// Reads the key `lens` of a camera file: a model with its parameters, or a calibration.
/// @param path  of the camera file, beside which calibrations are looked for.
LensOfFile read_lens(const yaml::Node& node, const std::filesystem::path& path,
                     yaml::Faults& faults);

}  // namespace groundray
