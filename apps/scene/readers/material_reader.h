#pragma once

#include <filesystem>
#include <optional>

#include "apps/scene/yaml_reader.h"
#include "core/appearance/material.h"

// Reader of the materials that scenes name, private to this library.
namespace groundray {

/// Folders of groundray's own data.
struct DataFolders {
  std::filesystem::path sensors;
  std::filesystem::path materials() const { return sensors.parent_path() / "materials"; }
};

/// Reads a material that a scene names: a file in data/materials, or a file relative to the scene's
/// folder if the name ends in .yaml. Records a fault and returns nullopt if it cannot be read.
/// @param path  path of the scene.
std::optional<Material> read_material(const yaml::Node& node, std::string_view key,
                                      const std::filesystem::path& path, const DataFolders& folders,
                                      yaml::Faults& faults);

}  // namespace groundray
