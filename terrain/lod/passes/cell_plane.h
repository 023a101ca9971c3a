#pragma once

#include <cmath>
#include <cstddef>

#include "terrain/lod/passes/border_thinning.h"

namespace groundray::passes {

/// Heights of a cell's corners (see Corner), times `factor`; NaN where one is missing.
struct Corners {
  double height[4];
  int factor = 1;
  double per_factor = 1;

  double operator[](Corner corner) const noexcept { return height[corner]; }
  void scale(int by, double per_by) noexcept {
    for (double& each : height) each *= by;
    factor = by;
    per_factor = per_by;
  }
};

inline double larger(double a, double b) noexcept { return b > a ? b : a; }  // a if b is NaN

/// Plane start + x slope_x + y slope_y over a cell.
struct Plane {
  double start, slope_x, slope_y;
};

/// Returns the plane of one half of a cell; NaN if the half does not exist. Slopes are height
/// differences between corners, times `per_x` and `per_y`.
inline Plane plane_of(Corner half, const Corners& at, double per_x, double per_y) noexcept {
  const bool rises_along_north = half == NorthWest || half == NorthEast;
  const bool rises_along_west = half == NorthWest || half == SouthWest;
  const double rise_x =
      rises_along_north ? at[NorthEast] - at[NorthWest] : at[SouthEast] - at[SouthWest];
  const double rise_y =
      rises_along_west ? at[SouthWest] - at[NorthWest] : at[SouthEast] - at[NorthEast];
  const double start = half == SouthEast ? at[NorthEast] - rise_x : at[NorthWest];
  return {start, rise_x * per_x, rise_y * per_y};
}

/// Returns whether all three corners of a half exist.
inline bool exists(Corner half, const Corners& at) noexcept {
  const Corner opposite = static_cast<Corner>(3 - half);
  double sum = 0;
  for (const Corner corner : {NorthWest, NorthEast, SouthWest, SouthEast}) {
    if (corner != opposite) sum += at[corner];
  }
  return !std::isnan(sum);
}

/// Returns the largest vertical distance between a main diagonal and the midpoints of the DEM's
/// diagonals that it crosses, in cells [begin, end) along it. `heights` is the first sample of cell
/// `begin`.
inline double worst_of_main_diagonal(const float* heights, std::ptrdiff_t stride, int begin,
                                     int end, double from, double slope, double weight) noexcept {
  double worst = 0;
  for (int i = begin; i < end; ++i) {
    const float* upper = heights + (i - begin) * (stride + 1);
    const double reference = (static_cast<double>(upper[1]) + upper[stride]) * weight;
    worst = larger(worst, std::abs(from + (2 * i + 1) * slope - reference));
  }
  return worst;
}

}  // namespace groundray::passes
