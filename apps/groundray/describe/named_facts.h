#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/groundray/describe/facts.h"

namespace groundray {

/// Describes a file of groundray's own: a lidar, a camera or a material. Nothing for a scene, or a
/// file that does not begin as one of these.
/// @throws Error as load_lidar, load_camera and load_material, or if the file is no YAML.
std::optional<Facts> yaml_facts(const std::filesystem::path& file);

/// Describes all that have a name among the presets, materials and assets of groundray's data:
/// `rock` is a material and an asset. Empty for other names.
/// @throws Error as yaml_facts.
std::vector<Facts> named_facts(const std::string& name);

/// Returns the names of all presets, materials and assets, sorted, each once.
/// @throws Error if a folder of groundray's data cannot be read.
std::vector<std::string> names_of_data();

}  // namespace groundray
