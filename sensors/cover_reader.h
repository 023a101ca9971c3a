#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "sensors/material_reader.h"
#include "sensors/world_spec.h"
#include "sensors/yaml_reader.h"

// How scenes say what the ground is made of, private to this library.
namespace groundray {

/// Reads the key `texture` of a map: images that repeat over the ground.
std::optional<GroundTextureSpec> read_ground_texture(yaml::Map& map,
                                                     const std::filesystem::path& path,
                                                     yaml::Faults& faults);

/// Reads the key `cover` of the terrain: layers over its own material.
std::vector<CoverSpec> read_cover(yaml::Map& terrain, const std::filesystem::path& path,
                                  const DataFolders& folders, yaml::Faults& faults);

}  // namespace groundray
