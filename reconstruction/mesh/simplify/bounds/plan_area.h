#pragma once

#include <glm/vec3.hpp>

namespace groundray {

/// Returns twice the area of a triangle in plan view, positive if it is counter-clockwise.
inline double twice_plan_area_m2(const glm::dvec3& a, const glm::dvec3& b,
                                 const glm::dvec3& c) noexcept {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

}  // namespace groundray
