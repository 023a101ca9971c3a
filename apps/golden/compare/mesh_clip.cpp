#include "apps/golden/compare/mesh_clip.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <limits>
#include <utility>

namespace groundray::golden {
namespace {

using Polygon = std::vector<glm::dvec3>;

/// Half-space in which one coordinate is at least (sign 1) or at most (sign -1) the limit.
struct HalfSpace {
  glm::length_t axis = 0;
  double limit_m = 0;
  double sign = 1;

  double depth_m(const glm::dvec3& p) const { return sign * (p[axis] - limit_m); }
};

std::vector<HalfSpace> half_spaces(const Scope& scope) {
  std::vector<HalfSpace> all;
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    if (std::isfinite(scope.low_m[axis])) all.push_back({axis, scope.low_m[axis], 1});
    if (std::isfinite(scope.high_m[axis])) all.push_back({axis, scope.high_m[axis], -1});
  }
  return all;
}

/// Returns the part of a convex polygon that is inside a half-space.
Polygon cut(const Polygon& polygon, const HalfSpace& half) {
  Polygon result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double of_p = half.depth_m(p), of_q = half.depth_m(q);
    if (of_p >= 0) result.push_back(p);
    if ((of_p >= 0) == (of_q >= 0)) continue;
    glm::dvec3 at = glm::mix(p, q, of_p / (of_p - of_q));
    at[half.axis] = half.limit_m;  // without rounding
    result.push_back(at);
  }
  return result;
}

/// Vertices of the part: those of the mesh are shared, those of cuts are not.
class PartBuilder {
 public:
  explicit PartBuilder(const TriangleMesh& mesh)
      : mesh_(mesh), index_of_(mesh.vertices_m.size(), none) {}

  void add_whole(std::uint32_t triangle) {
    glm::uvec3 corners;
    for (glm::length_t k = 0; k < 3; ++k) corners[k] = index_of(mesh_.triangles[triangle][k]);
    add(triangle, corners);
  }
  void add_polygon(std::uint32_t triangle, const Polygon& polygon) {
    if (polygon.size() < 3) return;
    const auto first = static_cast<std::uint32_t>(part_.mesh.vertices_m.size());
    part_.mesh.vertices_m.insert(part_.mesh.vertices_m.end(), polygon.begin(), polygon.end());
    for (std::uint32_t k = 2; k < polygon.size(); ++k)
      add(triangle, {first, first + k - 1, first + k});
  }
  MeshPart done() { return std::move(part_); }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t index_of(std::uint32_t vertex) {
    if (index_of_[vertex] == none) {
      index_of_[vertex] = static_cast<std::uint32_t>(part_.mesh.vertices_m.size());
      part_.mesh.vertices_m.push_back(mesh_.vertices_m[vertex]);
    }
    return index_of_[vertex];
  }
  void add(std::uint32_t triangle, const glm::uvec3& corners) {
    part_.mesh.triangles.push_back(corners);
    part_.triangle_of.push_back(triangle);
  }

  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> index_of_;
  MeshPart part_;
};

}  // namespace

MeshPart clipped(const TriangleMesh& mesh, const Scope& scope) {
  const std::vector<HalfSpace> halves = half_spaces(scope);
  PartBuilder part(mesh);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::uvec3& corners = mesh.triangles[t];
    Polygon polygon;
    for (glm::length_t k = 0; k < 3; ++k) polygon.push_back(mesh.vertices_m[corners[k]]);
    if (std::ranges::all_of(polygon, [&](const glm::dvec3& p) { return scope.contains(p); })) {
      part.add_whole(t);
      continue;
    }
    for (const HalfSpace& half : halves) polygon = cut(polygon, half);
    part.add_polygon(t, polygon);
  }
  return part.done();
}

}  // namespace groundray::golden
