#pragma once

#include <cstddef>

#include "reconstruction/mesh/accuracy/accuracy.h"

/// Means of distances, with bounds, from sampled distances. Not installed.
namespace groundray {

/// Area-weighted sums over the parts of a surface.
struct DistanceSums {
  double distance = 0, square = 0;   // of the distance at the centroids, and its square
  double low = 0, low_square = 0;    // of lower bounds of the parts' means
  double high = 0, high_square = 0;  // of upper bounds of the parts' means
  double spread = 0, area_m2 = 0;
  std::size_t samples = 0;

  /// Adds a part.
  /// @param distance_m       at the part's centroid.
  /// @param spread_m         bound of the root-mean-square difference from it over the part.
  /// @param high_m           upper bound of the mean over the part.
  /// @param high_square_m2   upper bound of the mean square over the part.
  void add(double distance_m, double spread_m, double high_m, double high_square_m2,
           double part_m2) noexcept;
  void operator+=(const DistanceSums& more) noexcept;

  struct Means {
    BoundedLength mean, rms;
  };
  /// @param rounding_m    rounding error of each distance.
  /// @param sum_rounding  relative rounding error of the sums.
  Means means(double rounding_m, double sum_rounding) const noexcept;
};

}  // namespace groundray
