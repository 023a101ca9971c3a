#pragma once

#include <filesystem>

#include "apps/scene/yaml_reader.h"
#include "terrain/relief/relief.h"

// Reader of relief from YAML, private to this library.
namespace groundray {

/// Reads the map `relief` of a scene's terrain, with the image that it names.
/// @param path  path of the scene; files are relative to its folder.
ReliefSpec read_relief(yaml::Map map, const std::filesystem::path& path, yaml::Faults& faults);

}  // namespace groundray
