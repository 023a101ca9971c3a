#include "core/geometry/footprint.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace groundray {

SurfacePatch surface_patch(double width_m, const glm::dvec3& direction,
                           const glm::dvec3& normal) noexcept {
  const double cosine = glm::dot(direction, normal);
  glm::dvec3 level = glm::cross(normal, direction);
  double sine = glm::length(level);
  if (!(sine > 1e-9)) {  // normal incidence: any direction in the surface serves
    const bool is_steep = std::abs(normal.x) > 0.7;
    level = glm::cross(normal, is_steep ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0));
    sine = glm::length(level);
  }
  level /= sine;
  const glm::dvec3 along = glm::cross(normal, level);
  return {width_m * level, width_m / std::max(std::abs(cosine), least_patch_cosine) * along};
}

Footprint footprint_of(const SurfacePatch& patch, const Tangents& tangents) noexcept {
  return {uv_step(tangents, patch.a_m), uv_step(tangents, patch.b_m)};
}

}  // namespace groundray
