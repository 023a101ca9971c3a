#include "core/appearance/triplanar.h"

#include <glm/common.hpp>

namespace groundray {
namespace {

/// Components of a normal up to this value have no weight: sin(23.58 degrees). It is less than
/// 1/sqrt(3), so that at least one component has a weight.
constexpr double silent_component = 0.4;

}  // namespace

glm::dvec3 triplanar_weights(const glm::dvec3& normal) noexcept {
  const glm::dvec3 excess = glm::max(glm::abs(normal) - silent_component, glm::dvec3(0));
  const glm::dvec3 square = excess * excess;
  return square / (square.x + square.y + square.z);
}

glm::vec3 triplanar_color(const Texture& texture, const glm::dvec3& p_m, const glm::dvec3& normal,
                          const SurfacePatch& patch, double period_m,
                          Filtering filtering) noexcept {
  const glm::dvec3 weights = triplanar_weights(normal);
  glm::vec3 color(0);
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    if (weights[axis] == 0) continue;
    const glm::length_t u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    const auto flat = [&](const glm::dvec3& d_m) { return glm::dvec2(d_m[u], d_m[v]) / period_m; };
    const Footprint footprint{flat(patch.a_m), flat(patch.b_m)};
    color += static_cast<float>(weights[axis]) * texture.color(flat(p_m), footprint, filtering);
  }
  return color;
}

}  // namespace groundray
