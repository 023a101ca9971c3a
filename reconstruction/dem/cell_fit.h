#pragma once

// Private to the library: the ground of one cell from its points.
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/dem/cell_columns.h"
#include "reconstruction/dem/neighbour_surface.h"
#include "reconstruction/dem/packed_point.h"

namespace groundray {

/// The ground at a cell's sample.
struct CellHeight {
  SurfacePlane plane;  ///< its height is above the reference
  double variance_m2 = 0;
  double chi2 = 0;                      ///< per degree of freedom; NaN where there is none
  std::uint32_t lidar = 0, stereo = 0;  ///< points that count for something
};

/// Fits planes to the points of cells, one after the other.
///
/// Points are freed of the bend of the neighbours' surface first, and of the cell's own crest: what
/// its first guess is above that surface, of which the ground bends by -2 along columns and rows;
/// the fewer points (4 / n), the less of it. A point's weight is that of CellColumns, with the
/// neighbours' slope and its covariance at first, then the fit's. Slopes are held to the
/// neighbours' by what those know. The start has the median height and the neighbours' slope;
/// residuals are in units of their sd, times 1.4826 of their median where that is above 1; Huber's
/// weights (k = 1.345) come up to three times, then, with slope and scale of that, Tukey's (c
/// = 4.685) up to five.
///
/// The variance is that of the linear estimate with the last weights: of the points' noise, times
/// the fit's chi² per degree of freedom where that is above 1; of what groups have in common, each
/// with its share of the weight, not lessened by how many points it has; of the slope that the
/// neighbours lend; and of the bend.
///
/// One point or two are weighed against the neighbours' surface instead: see fit_few.
/// @see Huber, Ronchetti, Robust statistics (2009), chapter 7.
class CellFit {
 public:
  /// @param outlier_share  of all points; with 0 one point is as good as many.
  explicit CellFit(double outlier_share) noexcept;

  /// @param points       of the cell's ground, ascending; at least one.
  /// @param step_m       of the frame.
  /// @param reference    which heights are above, in steps of PackedPoint.
  /// @return nothing if all points are more likely to be outliers than not.
  std::optional<CellHeight> operator()(std::span<const PackedPoint> points,
                                       const NeighbourSurface& neighbours, glm::dvec2 step_m,
                                       std::int32_t reference);

 private:
  struct Sums;
  struct Levers;
  float kth_size(std::size_t k);
  double median_height(const SurfacePlane& slopes);
  double scale(const SurfacePlane& plane);
  template <typename Robust>
  Sums sum(const SurfacePlane& plane, double scale, const Robust& robust);
  template <typename Robust>
  Sums iterate(SurfacePlane& plane, const NeighbourSurface& neighbours, double scale, int rounds,
               const Robust& robust);
  void compare(const SurfacePlane& plane, double bias_m2, CellHeight& found);
  std::optional<CellHeight> fit_few_points(const NeighbourSurface& neighbours, glm::dvec2 step_m,
                                           double reference_m) const;
  Levers levers(const Sums& sums, const NeighbourSurface& neighbours, glm::dvec2 step_m);
  CellHeight finish(const SurfacePlane& plane, const Sums& sums, const NeighbourSurface& neighbours,
                    glm::dvec2 step_m);

  double outliers_per_m_ = 0;
  double own_crest_ = 0;  // which share of it points were freed of
  CellColumns points_;
  std::vector<double> bias_sum_m_;  // of each group
};

}  // namespace groundray
