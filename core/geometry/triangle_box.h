#pragma once

#include <array>
#include <glm/vec3.hpp>

namespace groundray {

/// Corners of a triangle.
using Corners = std::array<glm::dvec3, 3>;

/// Returns whether a triangle has a point in an axis-aligned box; boundaries belong to both.
/// @see Akenine-Möller, Fast 3D triangle-box overlap testing (2001): thirteen separating axes.
bool overlaps_box(const Corners& triangle, const glm::dvec3& low, const glm::dvec3& high) noexcept;

/// Part of a triangle in a box.
struct TrianglePart {
  double area = 0;
  glm::dvec3 centroid{0};  ///< mean of its corners if it has no area
};

/// Returns the area and the centroid of a triangle.
TrianglePart whole_part(const Corners& triangle) noexcept;

/// Returns the part of a triangle in an axis-aligned box that it overlaps.
/// @see Sutherland, Hodgman, Reentrant polygon clipping (1974).
TrianglePart part_in_box(const Corners& triangle, const glm::dvec3& low,
                         const glm::dvec3& high) noexcept;

}  // namespace groundray
