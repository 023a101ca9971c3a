#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "apps/scene/readers/material_reader.h"
#include "apps/scene/world_spec.h"
#include "apps/scene/yaml_reader.h"

// Readers of the ground's cover from YAML, private to this library.
namespace groundray {

/// Reads the key `texture` of a map: images that repeat over the ground.
std::optional<GroundTextureSpec> read_ground_texture(yaml::Map& map,
                                                     const std::filesystem::path& path,
                                                     yaml::Faults& faults);

/// Reads the key `cover` of the terrain: layers over its own material.
std::vector<CoverSpec> read_cover(yaml::Map& terrain, const std::filesystem::path& path,
                                  const DataFolders& folders, yaml::Faults& faults);

}  // namespace groundray
