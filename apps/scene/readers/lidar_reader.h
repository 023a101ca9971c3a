#pragma once

#include <filesystem>

#include "apps/scene/yaml_reader.h"
#include "sensors/lidar/lidar_spec.h"

// Readers of lidars from YAML, private to this library.
namespace groundray {

/// Reads a lidar file.
/// @param path  path of the file; files that it names are relative to its folder.
LidarSpec read_lidar(const yaml::Node& node, const std::filesystem::path& path,
                     yaml::Faults& faults);

/// Applies the keys of a scene's entry that change a lidar.
/// @param path  path of the scene.
void change_lidar(yaml::Map& entry, const std::filesystem::path& path, LidarSpec& lidar,
                  yaml::Faults& faults);

}  // namespace groundray
