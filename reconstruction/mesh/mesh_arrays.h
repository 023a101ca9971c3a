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

/// Number of a vertex, triangle or other item that does not exist.
constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

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

  std::size_t size() const noexcept { return begins.size() - 1; }

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

/// Groups the triangles of a mesh by vertex. One that repeats a vertex is listed there repeatedly.
inline Buckets triangles_at_vertices(const TriangleMesh& mesh) {
  Buckets corners = sorted_in(mesh.vertices_m.size(), 3 * mesh.triangles.size(), [&](auto corner) {
    return mesh.triangles[corner / 3][static_cast<int>(corner % 3)];
  });
  for (std::uint32_t& item : corners.items) item /= 3;
  return corners;
}

}  // namespace groundray
