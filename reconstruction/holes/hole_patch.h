#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/mesh.h"
#include "reconstruction/holes/mesh_rims.h"

namespace groundray {

/// A mesh and how its triangles hang together.
struct RimmedMesh {
  const TriangleMesh& mesh;
  const EdgePairs& pairs;
  const MeshRims& rims;
  const VertexStars& stars;
};

/// Whether a patch goes on smoothly from the rim, or is flat between its vertices.
enum class PatchShape { Smooth, Flat };

/// Triangles that close a rim.
struct HolePatch {
  std::vector<glm::dvec3> points_m;  ///< that it adds
  /// The n vertices of the rim are numbers 0 to n - 1, in the order of the chain, each at the end
  /// of its half-edge; then come the points.
  std::vector<glm::uvec3> triangles;
};

/// Closes a rim with triangles as small as those round about.
/// @param chain  one of the mesh's rims, of at least 3 borders.
/// @return nothing where no triangles between the rim's vertices give a manifold, or where smooth
///         ones would lead far away.
std::optional<HolePatch> patch_hole(const RimmedMesh& at, std::span<const HalfEdge> chain,
                                    PatchShape shape);

}  // namespace groundray
