#pragma once

#include <vector>

#include "terrain/water/water.h"

namespace groundray {

/// Returns the distance of each sample to the nearest one where water stands at least
/// `least_depth_m` deep, metres, row by row; infinite if there is none.
/// @see Felzenszwalb, Huttenlocher, Theory of Computing 8 (2012), 415-428.
std::vector<float> distance_to_water_m(const StandingWater& water, double least_depth_m);

}  // namespace groundray
