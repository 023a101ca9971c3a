#pragma once

#include "core/random.h"

namespace groundray {

/// Returns a smooth random function of the place along a line, from -1 to 1: independent uniform
/// values at knots, joined by smooth steps.
/// @param key    selects the function; its `pulse` is not used.
/// @param knots  place, in distances of the knots; from 0 to 2^31.
double line_noise(RandomKey key, double knots) noexcept;

}  // namespace groundray
