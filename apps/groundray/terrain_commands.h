#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>

#include "terrain/dem/dem_io.h"

namespace groundray {

/// Error bounds of a mesh.
struct MeshRequest {
  double max_error_m = 0;               ///< vertical error permitted everywhere
  std::optional<glm::dvec3> viewpoint;  ///< position in W from which angle_rad is permitted as well
  double angle_rad = 0;
};

/// Converts a DEM to a mesh, writes it to `out` (.ply, .obj, .stl or .glb), and prints its size.
/// @throws Error as load_dem, build_terrain_mesh and write_mesh.
void mesh_terrain(const std::filesystem::path& dem, const DemOptions& options,
                  const MeshRequest& request, const std::filesystem::path& out);

/// Certifies a DEM, unless there is a certificate, and prints the deviations of each level.
/// @throws Error as Certificate::open_or_make.
void certify_terrain(const std::filesystem::path& dem, const DemOptions& options);

}  // namespace groundray
