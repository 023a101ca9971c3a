#pragma once

#include <glm/vec2.hpp>

#include "core/appearance/texture.h"

namespace groundray {

/// An image draped over the ground from above, its first row in the north. Immutable; any number of
/// threads may query it.
struct Drape {
  Texture image;            ///< with Wrap::Clamp
  glm::dvec2 corner_m{0};   ///< lower left (south-western) corner of the image, in D
  glm::dvec2 size_m{1, 1};  ///< size of the image along x and y; positive

  /// Returns the texture coordinates of `p` (D).
  glm::dvec2 uv_at(glm::dvec2 p) const noexcept { return (p - corner_m) / size_m; }

  /// Returns true if `p` (D) is in the image or on its boundary; false for NaN.
  bool covers(glm::dvec2 p) const noexcept {
    const glm::dvec2 uv = uv_at(p);
    return 0 <= uv.x && uv.x <= 1 && 0 <= uv.y && uv.y <= 1;
  }
};

}  // namespace groundray
