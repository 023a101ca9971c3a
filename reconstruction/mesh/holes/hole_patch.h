#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/holes/mesh_boundary.h"

namespace groundray {

/// Finds the triangles that intersect other than at shared corners and edges, by exact predicates
/// on the positions as given. Corners at equal positions count as shared. Triangles without area
/// are ignored.
/// @param first  only pairs with a triangle from this number on are tested.
/// @return pairs, smaller number first, sorted.
std::vector<std::pair<std::uint32_t, std::uint32_t>> crossings(const TriangleMesh& mesh,
                                                               std::uint32_t first);

/// Mesh with its adjacency.
struct AdjacentMesh {
  const TriangleMesh& mesh;
  const SurfaceMesh& surface;  ///< of the mesh, linked by find_boundary
  const Buckets& stars;        ///< of the surface, as from stars_of
};

/// Shape of a patch: continued smoothly from the boundary, or flat between its vertices.
enum class PatchShape { Smooth, Flat };

/// Triangles that close a hole.
struct HolePatch {
  std::vector<glm::dvec3> points_m;  ///< added points
  /// Corners: the n vertices of the boundary are numbered 0 to n - 1 in the order of the loop, each
  /// at the beginning of its half-edge; the points follow.
  std::vector<glm::uvec3> triangles;
};

/// Closes a hole with triangles as small as the surrounding ones.
/// @param loop  one of the mesh's boundaries, of at least 3 edges.
/// @return nothing if no triangulation of the boundary's vertices is manifold, or if the smooth
///         patch would lead far away.
std::optional<HolePatch> patch_hole(const AdjacentMesh& at, const BoundaryLoop& loop,
                                    PatchShape shape);

}  // namespace groundray
