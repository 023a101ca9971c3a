#pragma once

// Private to the library: the points of one cell, in columns, and what each of them weighs.
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "reconstruction/dem/neighbour_surface.h"
#include "reconstruction/dem/packed_point.h"

namespace groundray {

/// How far slopes are known: their covariance.
struct SlopeSpread {
  double xx = 0, xy = 0, yy = 0;
};

/// Returns the square of its rise over run.
inline double rise2(const SurfacePlane& plane) noexcept {
  return plane.slope_x * plane.slope_x + plane.slope_y * plane.slope_y;
}

/// Points of a cell, one entry of each column for each. Columns are longer, so that they are read
/// by whole vectors: what is beyond `count` weighs nothing. They are kept from cell to cell.
///
/// A point's variance is that of its distance from the ground: sd² ((1 - g lean)² + lean' G lean) +
/// g² across², with a slope g and its covariance G, and 1 - g lean no less than least_tilt(); a
/// stereo pair's bias has the same factor.
struct CellColumns {
  std::size_t count = 0;    ///< points
  std::size_t padded = 0;   ///< entries, a whole number of vectors
  bool is_leaning = false;  ///< some point
  std::vector<float> x_m, y_m, z_m;
  std::vector<float> noise_m2, across_m2, lean_x, lean_y;
  std::vector<float> level_bias_m, leaning_bias_m;  ///< of heights; the part that leans
  std::vector<float> bias_m;                        ///< of distances from the ground
  std::vector<float> variance_m2;                   ///< of distances from the ground
  std::vector<float> gain;              ///< 1 / variance_m2, less what the group has in common
  std::vector<float> per_sd;            ///< 1 / sd of the distance, with the bias
  std::vector<float> weight, size;      ///< for those who fit
  std::vector<std::uint32_t> group_of;  ///< number of each point's group in the cell
  std::vector<std::uint32_t> names;     ///< of the groups

  /// Fills columns up to the groups'.
  /// @param reference  which heights are above, in steps of PackedPoint.
  void unpack(std::span<const PackedPoint> points, glm::dvec2 step_m, std::int32_t reference);

  /// Leaves of heights what is above a bend.
  void unbend(const SurfaceBend& bend, glm::dvec2 step_m);

  /// Sets variances, biases and gains for ground of a slope. The points of a group together weigh
  /// no more than what they have in common lets them: in all 1 / (1 / sum(1 / variance) + bias²).
  void weigh(const SurfacePlane& plane, const SlopeSpread& spread);

 private:
  void number_groups(std::span<const PackedPoint> points);
  void tilt(const SurfacePlane& plane, const SlopeSpread& spread);

  std::vector<std::uint32_t> table_;  // where to look for a name
  std::vector<double> shares_;        // of each group
};

}  // namespace groundray
