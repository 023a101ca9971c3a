#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "sensors/sky/lat_long_grid.h"

namespace groundray {

/// Direction drawn at random.
struct DirectionSample {
  glm::dvec3 direction{0, 0, 1};  ///< unit, axes of W
  double pdf_per_sr = 0;          ///< density of the draw; 0 if nothing could be drawn
};

/// Sampler of directions, approximately in proportion to weights at the pixel centres of a
/// LatLongGrid. The probability of a patch between four centres is proportional to the mean of
/// their weights times its exact solid angle; within the patch the density is bilinear in azimuth
/// and height. The density therefore vanishes only where the grid's own interpolation does, and it
/// differs from that by at most a factor of 2, next to the poles. Immutable and therefore
/// thread-safe.
class DirectionSampler {
 public:
  /// @param weights  weights of the pixel centres, row by row; finite and >= 0.
  /// @throws Error unless there is one weight per pixel and their sum is finite and positive.
  DirectionSampler(const LatLongGrid& grid, std::vector<float> weights);

  /// Draws a direction. @param uniform  two independent numbers in [0, 1).
  DirectionSample sample(const glm::dvec2& uniform) const noexcept;

  /// Returns the density, 1/sr, with which `sample` draws a unit direction.
  double pdf_per_sr(const glm::dvec3& direction) const noexcept;

  const LatLongGrid& grid() const noexcept { return grid_; }

 private:
  struct Corners {
    double top_left, top_right, bottom_left, bottom_right;
  };
  Corners corners(int top, int bottom, int left, int right) const noexcept;
  double density(const Corners& corners, int column, int patch_row, double across,
                 double sink) const noexcept;

  LatLongGrid grid_;
  std::vector<float> weights_;
  std::vector<double> rows_;     // cumulative weight of the rows of patches, from 0
  std::vector<double> columns_;  // the same within each row of patches; width + 1 entries
};

}  // namespace groundray
