#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "sensors/lat_long_grid.h"

namespace groundray {

/// A direction drawn at random.
struct DirectionSample {
  glm::dvec3 direction{0, 0, 1};  ///< unit, axes of W
  double pdf_per_sr = 0;          ///< of having drawn it; 0 if nothing could be drawn
};

/// Draws directions about in proportion to what shines from them, given at the pixel centres of a
/// LatLongGrid. Within each patch between four centres the density is bilinear in azimuth and
/// height, its share of all the mean of its centres times its exact solid angle; so it vanishes
/// only where the grid's own interpolation does, and differs from that by at most a factor 2, next
/// to the poles. Immutable, so any number of threads may use one.
class DirectionSampler {
 public:
  /// @param weights  of the pixel centres, row by row; finite and >= 0.
  /// @throws Error unless there is one for each pixel, and one is positive.
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
  std::vector<double> rows_;     // up to each row of patches, the sum of what shines; one more
  std::vector<double> columns_;  // within each row of patches the same; a row has width + 1
};

}  // namespace groundray
