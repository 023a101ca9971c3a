#pragma once

#include <glm/vec3.hpp>

#include "core/image/luminance.h"

namespace groundray {

/// Ratio of a textured surface's colour at a point to its mean. Textures provide only this ratio;
/// the mean is that of the material's spectrum.
struct Tint {
  glm::vec3 color{1};    ///< factor on each of linear red, green and blue
  float brightness = 1;  ///< factor on the luminance, used for all other wavelengths
  /// Returns the product of two tints.
  Tint operator*(const Tint& other) const noexcept {
    return {color * other.color, brightness * other.brightness};
  }
};

/// Returns the ratio of a texel to the mean of its image, both linear; 1 for a channel whose mean
/// is 0.
inline Tint tint_of(const glm::vec3& texel, const glm::vec3& mean) noexcept {
  const auto ratio = [](double value, double by) {
    return by > 0 ? static_cast<float>(value / by) : 1.0f;
  };
  return {{ratio(texel.r, mean.r), ratio(texel.g, mean.g), ratio(texel.b, mean.b)},
          ratio(luminance(texel), luminance(mean))};
}

}  // namespace groundray
