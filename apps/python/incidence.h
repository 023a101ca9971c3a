#pragma once

#include <span>

namespace groundray::python {

/// Computes angles: of each pair, std::atan2(sine, cosine), rounded to float. Equal to the last bit
/// to what that function yields, but several at a time.
/// @param sines,cosines  0 or more, or NaN; of the same number as `angles_rad`.
void write_angles(std::span<const double> sines, std::span<const double> cosines,
                  std::span<float> angles_rad) noexcept;

}  // namespace groundray::python
