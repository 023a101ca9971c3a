#pragma once

#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>

namespace groundray {

/// Box along the axes of W outside which nothing of a clipped layer is drawn.
struct ClipBox {
  glm::dvec3 low_w_m{0}, high_w_m{0};

  /// Returns true if the point is inside or on the box. NaN is outside.
  bool contains(const glm::dvec3& p_w_m) const {
    return glm::all(glm::lessThanEqual(low_w_m, p_w_m)) &&
           glm::all(glm::lessThanEqual(p_w_m, high_w_m));
  }
};

}  // namespace groundray
