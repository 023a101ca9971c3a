#pragma once

// Private to the library: the points of one cell as columns, and their weights.
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "reconstruction/dem/fusion/neighbour_surface.h"
#include "reconstruction/dem/fusion/packed_point.h"

namespace groundray {

/// Covariance of a plane's slopes.
struct SlopeSpread {
  double xx = 0, xy = 0, yy = 0;
};

/// Returns the square of the plane's slope, rise over run.
inline double rise2(const SurfacePlane& plane) noexcept {
  return plane.slope_x * plane.slope_x + plane.slope_y * plane.slope_y;
}

/// Points of a cell, one entry of each column per point. Columns are padded to whole vectors;
/// entries beyond `count` have no weight. The memory is reused from cell to cell.
///
/// The variance of a point is that of its distance from the ground,
///     sd² ((1 - g lean)² + lean' G lean) + g² across²,
/// for a slope g with covariance G, where 1 - g lean is at least least_tilt(). The bias of a stereo
/// pair has the same factor.
struct CellColumns {
  std::size_t count = 0;    ///< number of points
  std::size_t padded = 0;   ///< number of entries, a whole number of vectors
  bool is_leaning = false;  ///< true if any point has a lean
  std::vector<float> x_m, y_m, z_m;
  std::vector<float> noise_m2, across_m2, lean_x, lean_y;
  std::vector<float> level_bias_m, leaning_bias_m;  ///< bias of heights; the part of it that leans
  std::vector<float> bias_m;                        ///< bias of distances from the ground
  std::vector<float> variance_m2;                   ///< variance of distances from the ground
  std::vector<float> gain;          ///< 1 / variance_m2, reduced by the common bias of the group
  std::vector<float> per_sd;        ///< 1 / sd of the distance, including the bias
  std::vector<float> weight, size;  ///< working memory of the fit
  std::vector<std::uint32_t> group_of;  ///< index in `names` of each point's group
  std::vector<std::uint32_t> names;     ///< PackedPoint::group of each group

  /// Fills x_m to leaning_bias_m, group_of and names.
  /// @param reference  height that z_m is relative to, in steps of PackedPoint.
  void unpack(std::span<const PackedPoint> points, glm::dvec2 step_m, std::int32_t reference);

  /// Subtracts a bend from the heights.
  void unbend(const SurfaceBend& bend, glm::dvec2 step_m);

  /// Sets variances, biases and gains for ground of the given slope. The common bias of a group
  /// limits the sum of its points' gains to 1 / (1 / sum(1 / variance) + bias²).
  void weigh(const SurfacePlane& plane, const SlopeSpread& spread);

 private:
  void number_groups(std::span<const PackedPoint> points);
  void tilt(const SurfacePlane& plane, const SlopeSpread& spread);

  std::vector<std::uint32_t> table_;  // hash table from names to groups
  std::vector<double> shares_;        // reduction of each group's gains
};

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
