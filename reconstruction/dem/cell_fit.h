#pragma once

// Private to the library: the ground of one cell from its points.
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

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
/// the fewer points (4 / n), the less of it. A point's weight is 1 / variance, where the variance
/// is that of its distance from the ground: sd² ((1 - g lean)² + lean' G lean) + g² across², with
/// the neighbours' slope g and its covariance G at first, then the fit's, and 1 - g lean no less
/// than least_tilt(); a stereo pair's bias has the same factor. And the points of a
/// group together weigh no more than what they have in common lets them: in all 1 / (1 / sum(1 /
/// variance) + bias²), as generalised least squares would have it. Slopes are held to the
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
  struct SlopeSpread {
    double xx = 0, xy = 0, yy = 0;  // covariance
  };
  void unpack(std::span<const PackedPoint> points, glm::dvec2 step_m, std::int32_t reference);
  void unbend(const NeighbourSurface& neighbours, glm::dvec2 step_m);
  void number_groups(std::span<const PackedPoint> points);
  void tilt(const SurfacePlane& plane, const SlopeSpread& spread);
  void weigh(const SurfacePlane& plane, const SlopeSpread& spread);
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
  double own_crest_ = 0;     // which share of it points were freed of
  std::size_t count_ = 0;    // points
  std::size_t padded_ = 0;   // entries below, a whole number of vectors; those beyond weigh nothing
  bool is_leaning_ = false;  // some point
  std::vector<float> x_m_, y_m_, z_m_, noise_m2_, across_m2_, lean_x_, lean_y_;
  std::vector<float> level_bias_m_, leaning_bias_m_;  // of heights; the part that leans
  std::vector<float> bias_m_;                         // of distances from the ground
  std::vector<float> variance_m2_, gain_, per_sd_, weight_, size_;
  std::vector<std::uint32_t> group_;        // number of each point's group in the cell
  std::vector<std::uint32_t> names_;        // of the groups
  std::vector<std::uint32_t> table_;        // where to look for a name
  std::vector<double> share_, bias_sum_m_;  // of each group
};

}  // namespace groundray
