#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/height_grid.h"
#include "terrain/ground.h"

namespace groundray {

/// Water on the samples of a grid, row by row; NaN where there is no height.
struct StandingWater {
  GridFrame frame;
  std::vector<float> depth_m;  ///< of water that fills the depressions up to their outlets
  /// Topographic wetness index ln(a / tan b): a is the area that drains through a sample, per width
  /// of a cell, metres; b the slope there.
  std::vector<float> wetness;  ///< empty unless requested
};

/// Treatment of the wetness index, whose computation takes as long as that of the depths.
enum class Wetness { Compute, Omit };

/// Returns where water stands and flows to, if it rains evenly. Water leaves the grid at its border
/// and at holes, and seeps away at the lowest sample of depressions deeper than `most_m`.
/// @see docs/reference/water.md
StandingWater standing_water(const HeightGrid& ground, double most_m,
                             Wetness wetness = Wetness::Compute);

/// Returns heights of the ground on a grid of square cells over all of it, north up.
/// @param memory_bytes  limit for these and for `standing_water`.
/// @throws Error if they take more memory, or as Ground::height_m_at.
HeightGrid sample_ground(const Ground& ground, double cell_m, std::size_t memory_bytes);

}  // namespace groundray
