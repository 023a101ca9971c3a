#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/random.h"
#include "core/tracing/leaf.h"
#include "core/tracing/ray.h"
#include "terrain/terrain_mesh.h"

namespace groundray::golden {

/// Rays, and what they hit on a mesh.
struct ReferenceRays {
  std::vector<Ray> rays;
  std::vector<double> range_m;         ///< infinite without a hit
  std::vector<std::int32_t> triangle;  ///< index in the mesh; -1 without a hit
  /// Distance of the ray to the nearest silhouette: an edge beyond which the mesh faces away or
  /// ends, in front of the hit or as far behind it as the ray would reach if it were moved by this
  /// distance. At most `limit_m`.
  std::vector<double> silhouette_m;
  std::vector<double> edge_m;  ///< distance of the ray to the nearest edge of its triangle
  double limit_m = 0;
};

/// Returns rays that start up to 50 m above the surface, most of them downwards.
std::vector<Ray> sample_rays(const HeightGrid& grid, std::size_t count, Seed seed);

/// Traces rays exactly on the mesh of leaves.
/// @param leaves  of the whole DEM, in blocks of block_cells.
/// @param mesh    of these leaves.
ReferenceRays trace_reference_rays(const HeightGrid& grid, const std::vector<Leaf>& leaves,
                                   int block_cells, const TerrainMesh& mesh, std::vector<Ray> rays);

}  // namespace groundray::golden
