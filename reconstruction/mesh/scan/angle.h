#pragma once

// Private to the library: wrapping of angles.
#include <cmath>
#include <numbers>

namespace groundray {

/// Full turn, rad.
inline constexpr double two_pi = 2 * std::numbers::pi;

/// Returns the equivalent angle from -pi to pi.
inline double wrapped(double angle_rad) {
  return angle_rad - two_pi * std::round(angle_rad / two_pi);
}

}  // namespace groundray
