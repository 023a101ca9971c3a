#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "sensors/scan_pattern.h"
#include "sensors/yaml_reader.h"

// How patterns are read from YAML, private to this library.
namespace groundray {

/// Reads the pattern of a lidar file: the keys of one kind, a spinning head's if there is no other.
/// @param path  of the file, beside which it looks for those that it names.
PatternSpec read_pattern(yaml::Map& root, const std::filesystem::path& path, yaml::Faults& faults);

/// Notes a fault at `node` unless a turn holds 1 to most_sequences firing sequences.
void check_turn(const yaml::Node& node, std::string_view key, const SpinningPattern& pattern,
                yaml::Faults& faults);

/// Returns a path that is relative to a file's folder. Names that GDAL knows how to open but that
/// are no paths (/vsizip/..., NETCDF:"...") stay as they are.
std::filesystem::path beside(const std::filesystem::path& file, const std::string& relative);

}  // namespace groundray
