#pragma once

#include <filesystem>

namespace groundray {

/// Prints what a file is and what it would take: a DEM, or a scene (.yaml, .yml).
/// @throws Error as load_dem and load_world.
void print_info(const std::filesystem::path& file);

}  // namespace groundray
