#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "apps/scene/yaml_reader.h"
#include "sensors/lidar/pattern/scan_pattern.h"

// Readers of scan patterns from YAML, private to this library.
namespace groundray {

/// Reads the pattern of a lidar file: the keys of one kind, by default a spinning head's.
/// @param path  path of the file; files that it names are relative to its folder.
PatternSpec read_pattern(yaml::Map& root, const std::filesystem::path& path, yaml::Faults& faults);

/// Records a fault at `node` unless a turn holds 1 to most_sequences firing sequences.
void check_turn(const yaml::Node& node, std::string_view key, const SpinningPattern& pattern,
                yaml::Faults& faults);

/// Returns the path of a file that is named relative to another file's folder. Names that GDAL can
/// open but that are not paths (/vsizip/..., NETCDF:"...") are returned unchanged.
std::filesystem::path beside(const std::filesystem::path& file, const std::string& relative);

}  // namespace groundray
