#pragma once

#include <cstddef>

#include "reconstruction/accuracy/accuracy.h"

/// Means of distances with bounds, for those who have a distance. Not installed.
namespace groundray {

/// What parts of a surface add up to, each by its area.
struct DistanceSums {
  double distance = 0, square = 0;   // m and m^2 amid the parts
  double low = 0, low_square = 0;    // that the parts have at least in the mean
  double high = 0, high_square = 0;  // and at most
  double spread = 0, area_m2 = 0;
  std::size_t samples = 0;

  /// Adds a part.
  /// @param distance_m       amid it.
  /// @param spread_m         root mean square of what it may differ by over the part.
  /// @param high_m           what its mean over the part is at most.
  /// @param high_square_m2   what its mean square is at most.
  void add(double distance_m, double spread_m, double high_m, double high_square_m2,
           double part_m2) noexcept;
  void operator+=(const DistanceSums& more) noexcept;

  struct Means {
    BoundedLength mean, rms;
  };
  /// @param rounding_m    of each distance.
  /// @param sum_rounding  of the sums, as a share.
  Means means(double rounding_m, double sum_rounding) const noexcept;
};

}  // namespace groundray
