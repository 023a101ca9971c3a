#pragma once

#include <filesystem>

namespace groundray {

/// Prints a description and the memory requirements of a DEM or a scene (.yaml, .yml), or the state
/// of a dataset, which is a folder with a dataset.yaml.
/// @throws Error as load_dem, load_simulation, read_summary.
void print_info(const std::filesystem::path& file);

}  // namespace groundray
