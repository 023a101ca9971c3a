#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/golden/conform/array_folder.h"
#include "core/geometry/height_grid.h"
#include "core/random.h"
#include "terrain/lod/quadtree.h"

namespace groundray::golden {

/// Settings of the mesh and the rays of a folder of passes.
struct PassSettings {
  double tolerance_m = 0.1;
  double angle_rad = 0;
  /// Position of the sensor in D, metres; by default, 2 m above the middle of the DEM.
  std::optional<glm::dvec3> viewpoint_m;
  int block_cells = 8;  ///< a power of two from 2 to 64
  std::size_t rays = 100'000;
  Seed seed{0};
  std::string commit;  ///< of groundray, for the manifest
};

/// Folder of passes: the DEM, the settings, and the arrays that passes and rays yield.
struct PassFolder {
  ArrayFolder arrays;
  HeightGrid grid;
  MeshBound bound;
  double silhouette_limit_m = 0;  ///< distances to silhouettes are known up to this one
  std::vector<ArrayEntry> entries;
};

/// Meshes a DEM, traces rays, and writes all arrays and manifest.json into a new or empty folder.
/// @throws Error if the DEM cannot be read, a setting is invalid, or the folder is not empty.
void write_pass_folder(const std::filesystem::path& dem, const PassSettings& settings,
                       const std::filesystem::path& out);

/// Reads the manifest and the DEM of a folder that write_pass_folder has written, and checks that
/// all arrays are there and as they were written.
/// @throws Error naming the file and the rule that it breaks.
PassFolder read_pass_folder(const std::filesystem::path& folder);

}  // namespace groundray::golden
