#pragma once

#include <filesystem>

namespace groundray {

/// Prints what a file is and what it would take: a DEM, or a scene (.yaml, .yml); or what is there
/// of a dataset, a folder with a dataset.yaml. @throws Error as load_dem, load_world, read_summary.
void print_info(const std::filesystem::path& file);

}  // namespace groundray
