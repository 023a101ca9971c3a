#pragma once

#include <filesystem>

#include "apps/scene/yaml_reader.h"
#include "sensors/camera/camera_spec.h"

// Readers of cameras from YAML, private to this library.
namespace groundray {

/// Reads a camera file. Each key is checked by itself; for combinations of keys, see check_rate and
/// complete_camera.
/// @param path  path of the file; files that it names are relative to its folder.
CameraSpec read_camera(const yaml::Node& node, const std::filesystem::path& path,
                       yaml::Faults& faults);

/// Applies the keys of a scene's entry that change a camera.
void change_camera(yaml::Map& entry, CameraSpec& camera, yaml::Faults& faults);

/// Records at `node` an exposure or readout that takes longer than the period of the images.
/// Applies to a camera without a trigger.
void check_rate(const yaml::Node& node, const CameraSpec& camera, yaml::Faults& faults);

/// Completes a camera whose keys are valid by themselves: a focal length that is not given becomes
/// that of the lens on its axis. Records contradictions between keys at `node`.
void complete_camera(const yaml::Node& node, CameraSpec& camera, yaml::Faults& faults);

}  // namespace groundray
