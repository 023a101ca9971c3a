#pragma once

// Private to the library: the ground of one cell, fitted to its points.
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/dem/fusion/cell_columns.h"
#include "reconstruction/dem/fusion/neighbour_surface.h"
#include "reconstruction/dem/fusion/packed_point.h"
#include "reconstruction/dem/fusion/quadric.h"

namespace groundray {

/// Ground at a cell's sample.
struct CellHeight {
  SurfacePlane plane;  ///< height_m is relative to the reference
  double variance_m2 = 0;
  double chi2 = 0;                      ///< per degree of freedom; NaN without any
  std::uint32_t lidar = 0, stereo = 0;  ///< numbers of points with weight
};

/// Robust fit of planes to the points of cells, one cell after the other.
///
/// The bend of the neighbours' surface and the crest of the cell itself are subtracted from the
/// points. The plane starts with the median height and the slope of the neighbours, whose
/// information constrains the slope throughout. Weights are those of CellColumns, times Huber's and
/// then Tukey's. A last fit with these weights adds what bend is left, if points throughout the
/// cell show it. The variance is that of this linear estimate and of the ground about it.
///
/// Cells of one or two points are combined with the neighbours' surface instead: see fit_few.
/// @see docs/theory/dem.md; Huber, Ronchetti, Robust statistics (2009), chapter 7.
class CellFit {
 public:
  /// @param outlier_share  fraction of outliers among all points; if 0, cells of one or two points
  ///        are fitted like others.
  explicit CellFit(double outlier_share) noexcept;

  /// Returns the ground of one cell; nothing if the probability that all points are outliers
  /// exceeds 1/2.
  /// @param points  points of the cell's ground, ascending by height; at least one.
  /// @param step_m  spacing of the frame's samples.
  /// @param reference  height that the result is relative to, in steps of PackedPoint.
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
  Levers levers(const QuadricTerms& per_term, glm::dvec2 step_m);
  CellHeight finish(const SurfacePlane& plane, const NeighbourSurface& neighbours,
                    glm::dvec2 step_m);

  double outliers_per_m_ = 0;
  double own_crest_ = 0;  // fraction of the crest that was subtracted
  CellColumns points_;
  std::vector<double> bias_sum_m_;  // effect on the height, per group
};

}  // namespace groundray
