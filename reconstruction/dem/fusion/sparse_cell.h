#pragma once

// Private to the library: the ground of a cell with one or two points, each of which may be an
// outlier.
#include <array>
#include <cstdint>
#include <glm/vec2.hpp>

#include "reconstruction/dem/fusion/neighbour_surface.h"

namespace groundray {

/// Point of such a cell. Its height is relative to the neighbours' surface at its position.
struct SparseCell {
  glm::dvec2 place_m{0};  ///< position from the sample
  double above_m = 0;
  double variance_m2 = 0;   ///< variance of the height, independent from point to point
  double bias_m = 0;        ///< bias that is common to its group
  std::uint32_t group = 0;  ///< name of its group
};

/// Ground at the sample.
struct FewHeight {
  double above_m = 0;  ///< height above the neighbours' surface
  double variance_m2 = 0;
  std::array<double, 2> is_ground{};  ///< probability that each point is ground
  double is_none = 0;                 ///< probability that all are outliers
};

/// Combines all choices of outliers among the points with the neighbours' surface by Bayes' rule:
/// the ground is normal about the neighbours' surface, points are normal about the ground, and
/// outliers have any height. The height and its variance are those of the mixture.
/// @param count  number of points, 1 or 2.
/// @param outliers_per_m  probability that a point is an outlier, per metre of height.
FewHeight fit_few(const std::array<SparseCell, 2>& points, int count,
                  const NeighbourSurface& neighbours, glm::dvec2 step_m,
                  double outliers_per_m) noexcept;

}  // namespace groundray
