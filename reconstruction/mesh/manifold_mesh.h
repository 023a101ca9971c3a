#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "reconstruction/mesh/measured_mesh.h"

namespace groundray {

/// Half-edge 3 * t + k is the edge of triangle t from its corner k to corner (k + 1) % 3.
using HalfEdge = std::uint32_t;
/// Half-edge beyond a boundary; vertex that does not exist.
constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Returns the next half-edge of the triangle.
constexpr HalfEdge next_of(HalfEdge h) { return h % 3 == 2 ? h - 2 : h + 1; }
/// Returns the previous half-edge of the triangle.
constexpr HalfEdge before(HalfEdge h) { return h % 3 == 0 ? h + 2 : h - 1; }

/// Returns the vertex at which a half-edge begins.
inline std::uint32_t corner_of(std::span<const glm::uvec3> triangles, HalfEdge h) {
  return triangles[h / 3][static_cast<int>(h % 3)];
}

/// Adjacency of the edges of a mesh.
struct EdgePairs {
  /// Opposite half-edge of each half-edge; `none` at a boundary.
  std::vector<HalfEdge> twins;
  /// True for each half-edge whose edge is tangled (non-manifold) and thus a boundary.
  std::vector<bool> is_tangled;
  std::vector<bool>
      is_dropped;  ///< of each triangle: true if it repeats a vertex or another triangle
  std::size_t tangled_edges = 0;  ///< with more than two triangles, or two in the same direction
  std::size_t dropped = 0;        ///< number of dropped triangles
};

/// Pairs the edges of triangles. An edge of two triangles that traverse it in opposite directions
/// joins them. Any other edge is a boundary of each of its triangles. Triangles that repeat a
/// vertex, or another triangle with the same winding, are dropped.
/// @param triangles  fewer than 1.4e9.
/// @param vertices   number of vertices: every corner's number is less.
EdgePairs pair_edges(std::span<const glm::uvec3> triangles, std::size_t vertices);

/// Returns the boundary half-edge that ends where `border` begins, found by turning about that
/// vertex through the joined triangles.
HalfEdge next_border(const EdgePairs& pairs, HalfEdge border);

/// Gives each fan of triangles at a vertex a vertex of its own; the first fan keeps the original.
/// @param pairs  of the triangles.
/// @return for each added vertex the one that it copies; added vertices are numbered from
///         `vertices` on.
std::vector<std::uint32_t> part_fans(std::vector<glm::uvec3>& triangles, std::size_t vertices,
                                     const EdgePairs& pairs);

/// Removes triangles that repeat a vertex, and those that traverse an edge in the same direction as
/// an earlier one, so that no edge is tangled. Returns the number of removed triangles.
std::size_t drop_conflicts(std::vector<glm::uvec3>& triangles, std::size_t vertices);

/// Returns the normal of a triangle, twice its area long.
inline glm::dvec3 area_vector_m2(const TriangleMesh& mesh, const glm::uvec3& t) noexcept {
  const glm::dvec3& a = mesh.vertices_m[t.x];
  return glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a);
}

/// Returns some of the values, in the order of their numbers; nothing if there are no values.
template <typename Value>
std::vector<Value> picked(const std::vector<Value>& values,
                          const std::vector<std::uint32_t>& numbers) {
  std::vector<Value> some;
  if (values.empty()) return some;
  some.reserve(numbers.size());
  for (const std::uint32_t i : numbers) some.push_back(values[i]);
  return some;
}

/// Adds a violation for each attribute that does not have one value per vertex or none.
void check_columns(const MeasuredMesh& mesh, Violations& broken);

/// Numbers of items, grouped by bucket; ascending in each.
struct Buckets {
  std::vector<std::uint32_t> begins;  ///< of each bucket, and the end of the last
  std::vector<std::uint32_t> items;

  std::span<const std::uint32_t> at(std::size_t bucket) const noexcept {
    return std::span(items).subspan(begins[bucket], begins[bucket + 1] - begins[bucket]);
  }
};

/// Groups the items below `count` by bucket; those for which `bucket_of` returns `none` are
/// omitted.
template <typename BucketOf>
Buckets sorted_in(std::size_t buckets, std::size_t count, const BucketOf& bucket_of) {
  Buckets sorted{std::vector<std::uint32_t>(buckets + 1), {}};
  for (std::uint32_t i = 0; i < count; ++i) {
    if (const std::uint32_t bucket = bucket_of(i); bucket != none) ++sorted.begins[bucket + 1];
  }
  std::partial_sum(sorted.begins.begin(), sorted.begins.end(), sorted.begins.begin());
  sorted.items.resize(sorted.begins.back());
  std::vector<std::uint32_t> ends(sorted.begins.begin(), sorted.begins.end() - 1);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (const std::uint32_t bucket = bucket_of(i); bucket != none) sorted.items[ends[bucket]++] = i;
  }
  return sorted;
}

/// Mesh in which each edge has one or two consistently wound triangles, and each vertex one fan.
struct ManifoldMesh {
  TriangleMesh shape;                  ///< without levels, unused vertices and dropped triangles
  EdgePairs pairs;                     ///< of `shape`: nothing is tangled or dropped
  std::vector<std::uint32_t> sources;  ///< of each vertex: its number in the original
  std::size_t tangled_edges = 0;       ///< edges that were cut open, as EdgePairs::tangled_edges
  std::size_t dropped = 0;             ///< triangles, as EdgePairs::dropped
  std::size_t copies = 0;              ///< vertices added because the original joined several fans
};

/// Cuts a mesh open where it is not manifold. The mesh must satisfy check_mesh. No vertex moves,
/// and manifold parts stay as they are, except that unused vertices are removed.
ManifoldMesh cut_to_manifold(const TriangleMesh& mesh);

}  // namespace groundray
