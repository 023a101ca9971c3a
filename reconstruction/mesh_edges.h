#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace groundray {

constexpr std::uint32_t no_edge = 0xffffffff;

/// Directed edges are numbered 3 t + k: edge k of triangle t runs from corner k to corner
/// (k + 1) % 3.
constexpr std::uint32_t next_edge(std::uint32_t e) { return e % 3 == 2 ? e - 2 : e + 1; }
constexpr std::uint32_t edge_before(std::uint32_t e) { return e % 3 == 0 ? e + 2 : e - 1; }
inline std::uint32_t edge_begin(std::span<const glm::uvec3> triangles, std::uint32_t e) {
  return triangles[e / 3][static_cast<int>(e % 3)];
}
inline std::uint32_t edge_end(std::span<const glm::uvec3> triangles, std::uint32_t e) {
  return edge_begin(triangles, next_edge(e));
}

/// Returns for each directed edge the one that runs back, which is another triangle's; `no_edge` at
/// borders and wherever more than two triangles meet, or two whose windings differ.
std::vector<std::uint32_t> edge_twins(std::span<const glm::uvec3> triangles, std::size_t vertices);

/// What had to be left out to make triangles a surface.
struct ManifoldFaults {
  std::size_t triangles = 0;  ///< that were left out
  std::size_t vertices = 0;   ///< that were doubled
};

/// Makes a surface with borders, each edge that of at most two triangles which run along it in
/// opposite directions, and the triangles at each vertex one fan. Triangles that name a vertex
/// twice, or that run along an edge as an earlier one does, are left out; of several fans at a
/// vertex each but the first gets a vertex of its own.
/// @param doubled  takes, for each vertex that is added, the one whose place it has; they are
///                 numbered on from `vertices`.
ManifoldFaults make_manifold(std::vector<glm::uvec3>& triangles, std::size_t vertices,
                             std::vector<std::uint32_t>& doubled);

}  // namespace groundray
