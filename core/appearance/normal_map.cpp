#include "core/appearance/normal_map.h"

#include <algorithm>
#include <cmath>

namespace groundray {
namespace {

/// Returns the unit vector `normal`, rotated towards `geometric` until it is above its horizon.
glm::dvec3 lifted(const glm::dvec3& normal, const glm::dvec3& geometric) noexcept {
  const double cosine = glm::dot(normal, geometric);
  if (cosine >= least_shading_cosine) return normal;
  const glm::dvec3 across = normal - cosine * geometric;
  const double sine = glm::length(across);
  if (!(sine > 1e-6)) return geometric;  // opposite: no rotation is smaller than another
  // Slightly above, so that rounding does not bring it below.
  constexpr double up = least_shading_cosine * (1 + 1e-6);
  return up * geometric + std::sqrt(1 - up * up) / sine * across;
}

}  // namespace

glm::dvec3 decode_normal(glm::vec3 texel) noexcept { return 2.0 * glm::dvec3(texel) - 1.0; }

glm::dvec3 shading_normal(const Tangents& tangents, const glm::dvec3& base,
                          const glm::dvec3& geometric, const glm::dvec3& bump) noexcept {
  const glm::dvec3 across = tangents.dp_du - glm::dot(tangents.dp_du, base) * base;
  const double length = glm::length(across);
  if (!(length > 0)) return lifted(base, geometric);
  const glm::dvec3 x = across / length;
  const glm::dvec3 left = glm::cross(base, x);
  // On mirrored mappings v increases on the other side.
  const glm::dvec3 y = glm::dot(left, tangents.dp_dv) < 0 ? -left : left;
  const glm::dvec3 normal = bump.x * x + bump.y * y + std::max(bump.z, 0.0) * base;
  const double size = glm::length(normal);
  return lifted(size > 0 ? normal / size : base, geometric);
}

}  // namespace groundray
