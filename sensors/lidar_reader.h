#pragma once

#include <filesystem>
#include <string_view>

#include "sensors/lidar_spec.h"
#include "sensors/yaml_reader.h"

// How lidars are read from YAML, private to this library.
namespace groundray {

/// Notes a fault unless the format that `key` tells is 1.
void check_version(yaml::Map& root, std::string_view key, yaml::Faults& faults);

/// Reads a lidar file. @param path  of the file, beside which it looks for those that it names.
LidarSpec read_lidar(const yaml::Node& node, const std::filesystem::path& path,
                     yaml::Faults& faults);

/// Reads what a scene says of a lidar besides its file.
void change_lidar(yaml::Map& entry, LidarSpec& lidar, yaml::Faults& faults);

/// Returns a path that is relative to a file's folder. Names that GDAL knows how to open but that
/// are no paths (/vsizip/..., NETCDF:"...") stay as they are.
std::filesystem::path beside(const std::filesystem::path& file, const std::string& relative);

}  // namespace groundray
