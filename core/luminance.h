#pragma once

#include <glm/vec3.hpp>

namespace groundray {

/// The SI's luminous efficacy of the light that the eye sees best (540 THz), lm/W.
inline constexpr double luminous_efficacy_lm_w = 683;

/// Returns what the eye makes of linear sRGB: the CIE's Y by IEC 61966-2-1. Of radiance in
/// W/(m^2 sr) times luminous_efficacy_lm_w that is luminance in cd/m^2, of irradiance illuminance
/// in lx.
constexpr double luminance(const glm::dvec3& rgb) noexcept {
  return 0.2126 * rgb.r + 0.7152 * rgb.g + 0.0722 * rgb.b;
}

}  // namespace groundray
