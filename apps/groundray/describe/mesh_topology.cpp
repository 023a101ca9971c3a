#include "apps/groundray/describe/mesh_topology.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

namespace groundray {
namespace {

// Side of a triangle: its vertices in ascending order, and whether the triangle passes them so.
struct Side {
  std::uint32_t low = 0, high = 0;
  bool is_ascending = true;

  std::pair<std::uint32_t, std::uint32_t> edge() const { return {low, high}; }
};

std::vector<Side> sorted_sides(const TriangleMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (const glm::uvec3& triangle : mesh.triangles) {
    for (const auto& [a, b] : {std::pair(triangle.x, triangle.y), std::pair(triangle.y, triangle.z),
                               std::pair(triangle.z, triangle.x)})
      sides.push_back({std::min(a, b), std::max(a, b), a < b});
  }
  std::ranges::sort(sides, {}, &Side::edge);
  return sides;
}

}  // namespace

MeshTopology topology_of(const TriangleMesh& mesh) {
  MeshTopology topology;
  const std::vector<Side> sides = sorted_sides(mesh);
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].edge() == sides[i].edge()) ++end;
    if (end - i == 1) ++topology.boundary_edges;
    if (end - i > 2) ++topology.non_manifold_edges;
    if (end - i == 2 && sides[i].is_ascending == sides[i + 1].is_ascending)
      ++topology.reversed_edges;
    i = end;
  }
  if (mesh.vertices_m.empty()) return topology;
  const glm::dvec3 from_m = mesh.vertices_m.front();  // near, so that little is cancelled
  for (const glm::uvec3& triangle : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices_m[triangle.x] - from_m;
    const glm::dvec3 b = mesh.vertices_m[triangle.y] - from_m;
    const glm::dvec3 c = mesh.vertices_m[triangle.z] - from_m;
    topology.area_m2 += glm::length(glm::cross(b - a, c - a)) / 2;
    topology.volume_m3 += glm::dot(a, glm::cross(b, c)) / 6;
  }
  if (!topology.is_closed()) topology.volume_m3 = 0;
  return topology;
}

}  // namespace groundray
