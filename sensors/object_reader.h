#pragma once

#include <filesystem>
#include <vector>

#include "sensors/material_reader.h"
#include "sensors/world_spec.h"
#include "sensors/yaml_reader.h"

// How what stands and moves in a scene is read from YAML, private to this library.
namespace groundray {

/// Reads the list `objects` of a scene.
/// @param path  of the scene, beside which files are looked for.
std::vector<ObjectSpec> read_objects(yaml::Map& root, const std::filesystem::path& path,
                                     const DataFolders& folders, yaml::Faults& faults);

/// Reads the list `scatter` of a scene.
std::vector<ScatterLayer> read_scatter(yaml::Map& root, const std::filesystem::path& path,
                                       const DataFolders& folders, yaml::Faults& faults);

/// Reads the map `drive` of a platform or object.
DrivenPath read_drive(yaml::Map drive, yaml::Faults& faults);

}  // namespace groundray
