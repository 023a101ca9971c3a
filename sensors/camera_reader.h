#pragma once

#include <filesystem>

#include "sensors/camera/camera_spec.h"
#include "sensors/yaml_reader.h"

// How cameras are read from YAML, private to this library.
namespace groundray {

/// Reads a camera file, as far as keys go by themselves.
/// @param path  of the file, beside which it looks for those that it names.
CameraSpec read_camera(const yaml::Node& node, const std::filesystem::path& path,
                       yaml::Faults& faults);

/// Reads what a scene says of a camera besides its file.
void change_camera(yaml::Map& entry, CameraSpec& camera, yaml::Faults& faults);

/// Notes at `node` an exposure that is longer than from image to image of a camera that runs by
/// itself.
void check_rate(const yaml::Node& node, const CameraSpec& camera, yaml::Faults& faults);

/// Completes a camera whose keys are sound: a focal length that is not given becomes that of the
/// lens on its axis. Notes at `node` what of the camera does not go together.
void complete_camera(const yaml::Node& node, CameraSpec& camera, yaml::Faults& faults);

}  // namespace groundray
