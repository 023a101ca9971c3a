#pragma once

#include "core/math.h"

namespace groundray {

/// Decodes an sRGB value to a linear one, both 0 to 1.
/// @see IEC 61966-2-1.
inline double linear_of_srgb(double encoded) noexcept {
  return encoded <= 0.04045 ? encoded / 12.92 : math::pow((encoded + 0.055) / 1.055, 2.4);
}

/// Encodes a linear value as sRGB, both 0 to 1.
/// @see IEC 61966-2-1.
inline double srgb_of_linear(double linear) noexcept {
  return linear <= 0.0031308 ? linear * 12.92 : 1.055 * math::pow(linear, 1 / 2.4) - 0.055;
}

}  // namespace groundray
