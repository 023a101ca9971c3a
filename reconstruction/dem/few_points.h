#pragma once

// Private to the library: the ground of a cell of one or two points, each of which may be an
// outlier.
#include <array>
#include <cstdint>
#include <glm/vec2.hpp>

#include "reconstruction/dem/neighbour_surface.h"

namespace groundray {

/// A point of such a cell. Its height is above the neighbours' surface there.
struct FewPoint {
  glm::dvec2 place_m{0};  ///< from the sample
  double above_m = 0;
  double variance_m2 = 0;   ///< what differs from point to point
  double bias_m = 0;        ///< what the group has in common
  std::uint32_t group = 0;  ///< its name
};

/// The ground at the sample.
struct FewHeight {
  double above_m = 0;  ///< the neighbours' surface
  double variance_m2 = 0;
  std::array<double, 2> is_ground{};  ///< probability that the point is no outlier
  double is_none = 0;                 ///< probability that all are
};

/// Weighs every choice of points that may be outliers against what neighbours tell, by Bayes: the
/// ground is normal about the neighbours' surface, points are normal about the ground, and outliers
/// have any height. The height and its variance are those of the mixture.
/// @param count            of points: 1 or 2.
/// @param outliers_per_m   probability that a point is an outlier, per metre of height.
FewHeight fit_few(const std::array<FewPoint, 2>& points, int count,
                  const NeighbourSurface& neighbours, glm::dvec2 step_m,
                  double outliers_per_m) noexcept;

}  // namespace groundray
