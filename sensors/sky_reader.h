#pragma once

#include <filesystem>

#include "sensors/sky.h"
#include "sensors/yaml_reader.h"

// How the sky is read from YAML, private to this library.
namespace groundray {

/// Reads the map `sky` of a scene (docs/sky.md). The image that it names is read to see whether it
/// is a sky, and not kept.
/// @param path  of the scene, beside which files are looked for.
SkySpec read_sky(yaml::Map map, const std::filesystem::path& path, yaml::Faults& faults);

}  // namespace groundray
