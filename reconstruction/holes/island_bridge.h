#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/mesh.h"
#include "reconstruction/holes/mesh_rims.h"

namespace groundray {

/// The rim of a hole and the outlines of pieces of surface in it, as one chain.
struct BridgedRim {
  std::vector<std::uint32_t> vertices;
  std::vector<glm::uvec3> bridges;  ///< two triangles for each piece, between vertices of the mesh
};

/// Joins an outline to a rim by two triangles, where they are near to each other and the triangles
/// cross none beside them.
/// @param rim, outline  vertices, in the order in which triangles that fill them would run.
/// @return nothing if they share a vertex or there is no such place.
std::optional<BridgedRim> bridge(const TriangleMesh& mesh, const VertexStars& stars, BridgedRim rim,
                                 std::span<const std::uint32_t> outline);

/// Numbers the pieces into which a mesh falls.
/// @return of each triangle: the number of its piece; of those dropped, none.
std::vector<std::uint32_t> number_pieces(const EdgePairs& pairs);

}  // namespace groundray
