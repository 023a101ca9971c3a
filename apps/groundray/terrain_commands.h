#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>

#include "terrain/dem_io.h"

namespace groundray {

/// What a mesh shall keep to.
struct MeshRequest {
  double max_error_m = 0;               ///< vertical, everywhere
  std::optional<glm::dvec3> viewpoint;  ///< in W; from there angle_rad is allowed as well
  double angle_rad = 0;
};

/// Meshes a DEM and writes it to `out` (.ply, .obj or .glb), and says how large the mesh is.
/// @throws Error as load_dem, build_terrain_mesh and write_mesh.
void mesh_terrain(const std::filesystem::path& dem, const DemOptions& options,
                  const MeshRequest& request, const std::filesystem::path& out);

/// Certifies a DEM, unless that has been done, and prints what each level deviates.
/// @throws Error as Certificate::open_or_make.
void certify_terrain(const std::filesystem::path& dem, const DemOptions& options);

}  // namespace groundray
