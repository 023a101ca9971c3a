#include "core/geometry/triangle_box.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace groundray {
namespace {

// Returns whether the projections of a triangle and of a box about the origin on an axis are
// disjoint.
bool is_separating(const glm::dvec3& axis, const Corners& triangle,
                   const glm::dvec3& half) noexcept {
  const double reach = glm::dot(half, glm::abs(axis));
  const double a = glm::dot(axis, triangle[0]), b = glm::dot(axis, triangle[1]),
               c = glm::dot(axis, triangle[2]);
  return std::min({a, b, c}) > reach || std::max({a, b, c}) < -reach;
}

// Convex polygon: a triangle that at most six planes clip.
struct ClippedPolygon {
  std::array<glm::dvec3, 9> corners;
  std::size_t count = 0;
};

// Keeps the part where sign * p[axis] <= sign * bound.
ClippedPolygon clipped_by(const ClippedPolygon& polygon, glm::length_t axis, double sign,
                          double bound) noexcept {
  ClippedPolygon kept;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const glm::dvec3& from = polygon.corners[i];
    const glm::dvec3& to = polygon.corners[(i + 1) % polygon.count];
    const double from_in = sign * (bound - from[axis]), to_in = sign * (bound - to[axis]);
    if (from_in >= 0 && kept.count < kept.corners.size()) kept.corners[kept.count++] = from;
    if ((from_in < 0) != (to_in < 0) && from_in != 0 && to_in != 0 &&
        kept.count < kept.corners.size()) {
      glm::dvec3& corner = kept.corners[kept.count++];
      corner = glm::mix(from, to, from_in / (from_in - to_in));
      corner[axis] = bound;
    }
  }
  return kept;
}

}  // namespace

bool overlaps_box(const Corners& triangle, const glm::dvec3& low, const glm::dvec3& high) noexcept {
  const glm::dvec3 lowest = glm::min(glm::min(triangle[0], triangle[1]), triangle[2]);
  const glm::dvec3 highest = glm::max(glm::max(triangle[0], triangle[1]), triangle[2]);
  for (glm::length_t axis = 0; axis < 3; ++axis)
    if (lowest[axis] > high[axis] || highest[axis] < low[axis]) return false;
  const glm::dvec3 centre = 0.5 * (low + high), half = 0.5 * (high - low);
  const Corners about{triangle[0] - centre, triangle[1] - centre, triangle[2] - centre};
  const Corners edges{about[1] - about[0], about[2] - about[1], about[0] - about[2]};
  if (is_separating(glm::cross(edges[0], edges[1]), about, half)) return false;
  for (const glm::dvec3& edge : edges) {
    for (glm::length_t axis = 0; axis < 3; ++axis) {
      glm::dvec3 unit(0);
      unit[axis] = 1;
      if (is_separating(glm::cross(unit, edge), about, half)) return false;
    }
  }
  return true;
}

TrianglePart whole_part(const Corners& triangle) noexcept {
  const auto& [a, b, c] = triangle;
  return {0.5 * glm::length(glm::cross(b - a, c - a)), (a + b + c) / 3.0};
}

TrianglePart part_in_box(const Corners& triangle, const glm::dvec3& low,
                         const glm::dvec3& high) noexcept {
  ClippedPolygon polygon;
  polygon.count = triangle.size();
  std::ranges::copy(triangle, polygon.corners.begin());
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    polygon = clipped_by(polygon, axis, 1, high[axis]);
    polygon = clipped_by(polygon, axis, -1, low[axis]);
  }
  // A triangle that only touches the box may be lost to rounding.
  if (polygon.count == 0)
    return {0, glm::clamp((triangle[0] + triangle[1] + triangle[2]) / 3.0, low, high)};
  TrianglePart part;
  glm::dvec3 sum(0), mean(0);
  for (std::size_t i = 0; i < polygon.count; ++i) {
    mean += polygon.corners[i] / static_cast<double>(polygon.count);
    if (i == 0 || i + 1 == polygon.count) continue;
    const glm::dvec3 &a = polygon.corners[0], &b = polygon.corners[i], &c = polygon.corners[i + 1];
    const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
    part.area += area;
    sum += area * (a + b + c) / 3.0;
  }
  part.centroid = part.area > 0 ? sum / part.area : mean;
  return part;
}

}  // namespace groundray
