#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "core/mesh.h"

namespace groundray {

/// Half-edge 3 * t + k is the edge of triangle t from its corner k to corner (k + 1) % 3.
using HalfEdge = std::uint32_t;
/// Across a border, and where there is no vertex.
constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Returns the half-edge that follows in the triangle.
constexpr HalfEdge next_of(HalfEdge h) { return h % 3 == 2 ? h - 2 : h + 1; }
/// Returns the half-edge before it in the triangle.
constexpr HalfEdge before(HalfEdge h) { return h % 3 == 0 ? h + 2 : h - 1; }

/// Returns the vertex at which a half-edge begins.
inline std::uint32_t corner_of(std::span<const glm::uvec3> triangles, HalfEdge h) {
  return triangles[h / 3][static_cast<int>(h % 3)];
}

/// Which edges of a mesh are one surface's.
struct EdgePairs {
  std::vector<HalfEdge>
      twins;  ///< of each half-edge: the same edge the other way; none at a border
  std::vector<bool>
      is_tangled;  ///< of each half-edge: border where more than one triangle meets it
  std::vector<bool> is_dropped;   ///< of each triangle: repeats a vertex or another triangle
  std::size_t tangled_edges = 0;  ///< of more than two triangles, or two that run the same way
  std::size_t dropped = 0;        ///< triangles
};

/// Pairs the edges of triangles: an edge of two triangles that run it in opposite directions joins
/// them. Any other is a border of each of its triangles. Triangles that name a vertex twice, and
/// those that repeat another with the same winding, take no part.
/// @param triangles  fewer than 1.4e9.
/// @param vertices   how many there are: every corner's number is less.
EdgePairs pair_edges(std::span<const glm::uvec3> triangles, std::size_t vertices);

/// Returns the border that ends where `border` begins, round the triangles that are joined there.
HalfEdge next_border(const EdgePairs& pairs, HalfEdge border);

/// Gives each fan of triangles at a vertex a vertex of its own, but for the first, which keeps it.
/// Returns of each vertex that is added the one whose place it has; they are numbered on from
/// `vertices`.
/// @param pairs  of the triangles.
std::vector<std::uint32_t> part_fans(std::vector<glm::uvec3>& triangles, std::size_t vertices,
                                     const EdgePairs& pairs);

/// Leaves out triangles that name a vertex twice, and those that run along an edge as an earlier
/// one does: no edge is tangled then. Returns how many.
std::size_t drop_conflicts(std::vector<glm::uvec3>& triangles, std::size_t vertices);

/// A mesh whose every edge has one or two triangles, wound alike, and every vertex one fan of them.
struct ManifoldMesh {
  TriangleMesh shape;                  ///< without levels, unused vertices and dropped triangles
  EdgePairs pairs;                     ///< of `shape`: nothing is tangled or dropped
  std::vector<std::uint32_t> sources;  ///< of each vertex: which it was
  std::size_t tangled_edges = 0;       ///< that were cut, as EdgePairs has them
  std::size_t dropped = 0;             ///< triangles, likewise
  std::size_t copies = 0;              ///< vertices that were added, for theirs joined several fans
};

/// Cuts a mesh where it is no manifold. It must be as check_mesh asks. Nothing moves; what is a
/// manifold stays as it is but for vertices that no triangle has.
ManifoldMesh cut_to_manifold(const TriangleMesh& mesh);

}  // namespace groundray
