#pragma once

#include <filesystem>

#include "sensors/yaml_reader.h"
#include "terrain/relief.h"

// How relief is read from YAML, private to this library.
namespace groundray {

/// Reads the map `relief` of a scene's terrain, with the image that it names.
/// @param path  of the scene, beside which files are looked for.
ReliefSpec read_relief(yaml::Map map, const std::filesystem::path& path, yaml::Faults& faults);

}  // namespace groundray
