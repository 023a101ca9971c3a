#pragma once

#include <filesystem>
#include <vector>

#include "apps/scene/readers/material_reader.h"
#include "apps/scene/world_spec.h"
#include "apps/scene/yaml_reader.h"

// Readers of a scene's objects from YAML, private to this library.
namespace groundray {

/// Reads the list `objects` of a scene.
/// @param path  path of the scene; files are relative to its folder.
std::vector<ObjectSpec> read_objects(yaml::Map& root, const std::filesystem::path& path,
                                     const DataFolders& folders, yaml::Faults& faults);

/// Reads the list `scatter` of a scene.
std::vector<ScatterLayer> read_scatter(yaml::Map& root, const std::filesystem::path& path,
                                       const DataFolders& folders, yaml::Faults& faults);

/// Reads the map `drive` of a platform or object.
DrivenPath read_drive(yaml::Map drive, yaml::Faults& faults);

}  // namespace groundray
