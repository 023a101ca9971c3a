#pragma once

// Private to the library: angles of a turn.
#include <cmath>
#include <numbers>

namespace groundray {

/// Angle of a whole turn.
inline constexpr double two_pi = 2 * std::numbers::pi;

/// Returns the angle from -pi to pi that points the same way.
inline double wrapped(double angle_rad) {
  return angle_rad - two_pi * std::round(angle_rad / two_pi);
}

}  // namespace groundray
