#pragma once

#include <glm/vec3.hpp>

namespace groundray {

/// Luminous efficacy of monochromatic radiation of 540 THz (SI), lm/W.
inline constexpr double luminous_efficacy_lm_w = 683;

/// Returns the luminance of linear sRGB: the CIE's Y by IEC 61966-2-1. Times
/// luminous_efficacy_lm_w, radiance in W/(m^2 sr) gives luminance in cd/m^2, and irradiance in
/// W/m^2 illuminance in lx.
constexpr double luminance(const glm::dvec3& rgb) noexcept {
  return 0.2126 * rgb.r + 0.7152 * rgb.g + 0.0722 * rgb.b;
}

}  // namespace groundray
