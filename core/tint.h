#pragma once

#include <glm/vec3.hpp>

#include "core/luminance.h"

namespace groundray {

/// How a textured surface differs at a point from what it is on average. A texture says no more
/// than that: the material's spectrum says what the surface is on average.
struct Tint {
  glm::vec3 color{1};    ///< factor on each of linear red, green and blue
  float brightness = 1;  ///< factor on the luminance, which stands for all other wavelengths
  /// One on the other.
  Tint operator*(const Tint& other) const noexcept {
    return {color * other.color, brightness * other.brightness};
  }
};

/// Returns how a texel differs from the mean of its image, both linear; a channel whose mean is 0
/// does not.
inline Tint tint_of(const glm::vec3& texel, const glm::vec3& mean) noexcept {
  const auto ratio = [](double value, double by) {
    return by > 0 ? static_cast<float>(value / by) : 1.0f;
  };
  return {{ratio(texel.r, mean.r), ratio(texel.g, mean.g), ratio(texel.b, mean.b)},
          ratio(luminance(texel), luminance(mean))};
}

}  // namespace groundray
