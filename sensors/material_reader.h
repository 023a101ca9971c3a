#pragma once

#include <filesystem>
#include <optional>

#include "core/material.h"
#include "sensors/yaml_reader.h"

// How scenes name materials, private to this library.
namespace groundray {

/// Where the named things of groundray's own data are.
struct DataFolders {
  std::filesystem::path sensors;
  std::filesystem::path materials() const { return sensors.parent_path() / "materials"; }
};

/// Reads a material that a scene names: that of a file in data/materials, or a file beside the
/// scene if the name ends in .yaml. Notes a fault if there is none.
/// @param path  of the scene.
std::optional<Material> read_material(const yaml::Node& node, std::string_view key,
                                      const std::filesystem::path& path, const DataFolders& folders,
                                      yaml::Faults& faults);

}  // namespace groundray
