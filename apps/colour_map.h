#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "core/image/image.h"

// Painting of previews.
namespace groundray {

using Colour = glm::dvec3;  ///< red, green and blue, 0 to 1

/// Paints a pixel; does nothing outside the image.
inline void paint(Image8& image, int x, int y, const Colour& colour) {
  if (x < 0 || y < 0 || x >= image.width() || y >= image.height()) return;
  const auto pixel = image.at(x, y);
  for (glm::length_t i = 0; i < 3; ++i) {
    pixel[static_cast<std::size_t>(i)] =
        static_cast<std::uint8_t>(std::lround(std::clamp(colour[i], 0.0, 1.0) * 255));
  }
}

/// Maps 0 (near, yellow) to 1 (far, violet) to a colour, by interpolation of five colours of
/// viridis. Other values are clamped.
inline Colour range_colour(double share) {
  constexpr std::array<std::array<double, 3>, 5> map = {{{0.993, 0.906, 0.144},
                                                         {0.369, 0.789, 0.383},
                                                         {0.128, 0.567, 0.551},
                                                         {0.229, 0.322, 0.546},
                                                         {0.267, 0.005, 0.329}}};
  const double place = std::clamp(share, 0.0, 1.0) * (map.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(place), map.size() - 2);
  const auto colour = [&](std::size_t k) { return Colour(map[k][0], map[k][1], map[k][2]); };
  return glm::mix(colour(i), colour(i + 1), place - static_cast<double>(i));
}

}  // namespace groundray
