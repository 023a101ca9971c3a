#pragma once

#include <glm/vec2.hpp>

#include "core/texture.h"

namespace groundray {

/// An image laid on the ground from straight above, its first row in the north. Immutable; any
/// number of threads may ask.
struct Drape {
  Texture image;            ///< with Wrap::Clamp
  glm::dvec2 corner_m{0};   ///< the image's lower left (south-western) corner, in D
  glm::dvec2 size_m{1, 1};  ///< of the image, along x and y; positive

  /// Returns where in the image `p` (D) is.
  glm::dvec2 uv_at(glm::dvec2 p) const noexcept { return (p - corner_m) / size_m; }

  /// Whether `p` (D) is in the image or on its rim; NaN is not.
  bool covers(glm::dvec2 p) const noexcept {
    const glm::dvec2 uv = uv_at(p);
    return 0 <= uv.x && uv.x <= 1 && 0 <= uv.y && uv.y <= 1;
  }
};

}  // namespace groundray
