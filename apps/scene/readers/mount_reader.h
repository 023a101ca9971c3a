#pragma once

#include <filesystem>
#include <vector>

#include "apps/scene/scene_spec.h"
#include "apps/scene/yaml_reader.h"

// Reader of a scene's sensors, private to this library.
namespace groundray {

/// Reads the lists `lidars`, `cameras` and `stereo` of a scene, and the files that they name, into
/// `scene`. Contradictions between the keys of a lidar are not checked here.
/// @param path  path of the scene; files are relative to its folder.
void read_sensors(yaml::Map& root, const std::filesystem::path& path,
                  const std::filesystem::path& preset_folder, SceneSpec& scene,
                  yaml::Faults& faults);

}  // namespace groundray
