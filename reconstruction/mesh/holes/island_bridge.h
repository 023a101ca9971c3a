#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/holes/mesh_rims.h"

namespace groundray {

/// Boundary of a hole, joined with the outlines of pieces of surface inside it to a single chain.
struct BridgedRim {
  std::vector<std::uint32_t> vertices;
  std::vector<glm::uvec3> bridges;  ///< two triangles per piece, by the mesh's vertices
};

/// Joins an outline to a boundary by two triangles at a position where both are close and the
/// triangles intersect none of their neighbours.
/// @param rim, outline  vertices, in the winding order of triangles that fill them.
/// @return nothing if they share a vertex or there is no such position.
std::optional<BridgedRim> bridge(const TriangleMesh& mesh, const VertexStars& stars, BridgedRim rim,
                                 std::span<const std::uint32_t> outline);

/// Numbers the connected pieces of a mesh.
/// @return for each triangle, the number of its piece; `none` for dropped triangles.
std::vector<std::uint32_t> number_pieces(const EdgePairs& pairs);

}  // namespace groundray
