#pragma once

// Private to erosion: slopes of loose material.
#include <span>

#include "terrain/erosion/flow_tree.h"

namespace groundray {

/// Lets material slide to lower neighbours until no slope between neighbours is above `most_slope`,
/// rise over run. Conserves the sum of the heights. Heights that are NaN stay so.
void let_slide(const SampleGrid& grid, double most_slope, std::span<double> heights_m);

}  // namespace groundray
