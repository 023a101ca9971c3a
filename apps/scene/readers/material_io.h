#pragma once

#include <filesystem>
#include <string>

#include "core/appearance/material.h"

namespace groundray {

/// Reads a material file (docs/reference/materials.md), such as those in data/materials;
/// preset_names lists the names of a folder.
/// @throws Error with a line for each fault, in the order of the file: path:line:column, the key,
///         its value, the rule and a likely fix.
Material load_material(const std::filesystem::path& path);

/// Parses a text already in memory like load_material; `path` names the file in messages.
Material parse_material(const std::string& text, const std::filesystem::path& path);

}  // namespace groundray
