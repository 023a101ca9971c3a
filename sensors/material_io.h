#pragma once

#include <filesystem>
#include <string>

#include "core/material.h"

namespace groundray {

/// Reads a material file (docs/materials.md); those of data/materials are such files, and
/// preset_names lists the names of a folder's.
/// @throws Error with a line for each fault, in the order of the file: path:line:column, the key,
///         its value, the rule and a likely fix.
Material load_material(const std::filesystem::path& path);

/// As load_material, of a text already in memory; `path` stands for the file in messages.
Material parse_material(const std::string& text, const std::filesystem::path& path);

}  // namespace groundray
