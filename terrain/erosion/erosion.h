#pragma once

#include <cstddef>
#include <optional>

#include "core/geometry/height_grid.h"

namespace groundray {

/// Incision by streams: dz/dt = uplift - erodibility A^area_exponent S^slope_exponent, with A the
/// drained area in square metres and S the slope downstream. Outlets, at the border and beside
/// holes, stay where they are.
struct StreamPower {
  double years = 0;
  double erodibility = 0;  ///< m^(1 - 2 area_exponent) per year
  double area_exponent = 0.5;
  double slope_exponent = 1;
  double uplift_m_yr = 0;
  int steps = 20;  ///< after each of which the drainage is computed anew
};

/// Erosion of a DEM.
struct ErosionSpec {
  std::optional<StreamPower> streams;
  std::optional<double> talus_rad;  ///< angle of repose, above which ground slides down
};

/// Returns the ground after erosion: incised by streams, and with no slope between neighbouring
/// samples, in eight directions, above the angle of repose. Sliding conserves the sum of the
/// heights. The result does not depend on the number of threads.
/// @param memory_bytes  limit for the computation.
/// @throws Error listing every field of `spec` that is out of bounds, or if it takes more memory.
/// @see docs/reference/erosion.md
HeightGrid eroded(const HeightGrid& ground, const ErosionSpec& spec, std::size_t memory_bytes);

}  // namespace groundray
