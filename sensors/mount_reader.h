#pragma once

#include <filesystem>
#include <vector>

#include "sensors/scene_spec.h"
#include "sensors/yaml_reader.h"

// How scenes mount their sensors on the platform, private to this library.
namespace groundray {

/// Reads the lists `lidars`, `cameras` and `stereo` of a scene, and the files that they name, into
/// it. Whether the parts of a sensor go together is not looked at.
/// @param path  of the scene, beside which files are looked for.
void read_sensors(yaml::Map& root, const std::filesystem::path& path,
                  const std::filesystem::path& preset_folder, SceneSpec& scene,
                  yaml::Faults& faults);

}  // namespace groundray
