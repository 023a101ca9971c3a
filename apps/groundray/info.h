#pragma once

#include <filesystem>

namespace groundray {

/// Prints a description and the memory requirements of a DEM or a scene (.yaml, .yml), the state of
/// a dataset, which is a folder with a dataset.yaml, or a description of a mesh, cloud, image,
/// lidar, camera or material. A name that is no file is one of a preset, material or asset.
/// @throws Error as load_dem, load_simulation, read_summary, yaml_facts, and facts_of a file.
void print_info(const std::filesystem::path& file);

}  // namespace groundray
