#pragma once

#include <filesystem>

#include "apps/scene/yaml_reader.h"
#include "sensors/sky/sky.h"

// Reader of the sky from YAML, private to this library.
namespace groundray {

/// Reads the map `sky` of a scene (docs/theory/sky.md). The image that it names is read for
/// validation only, and not kept.
/// @param path  path of the scene; files are relative to its folder.
SkySpec read_sky(yaml::Map map, const std::filesystem::path& path, yaml::Faults& faults);

}  // namespace groundray
