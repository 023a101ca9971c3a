#pragma once

#include <filesystem>

#include "sensors/lidar_spec.h"
#include "sensors/yaml_reader.h"

// How lidars are read from YAML, private to this library.
namespace groundray {

/// Reads a lidar file. @param path  of the file, beside which it looks for those that it names.
LidarSpec read_lidar(const yaml::Node& node, const std::filesystem::path& path,
                     yaml::Faults& faults);

/// Reads what a scene says of a lidar besides its file. @param path  of the scene.
void change_lidar(yaml::Map& entry, const std::filesystem::path& path, LidarSpec& lidar,
                  yaml::Faults& faults);

}  // namespace groundray
