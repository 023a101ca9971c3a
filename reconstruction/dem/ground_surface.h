#pragma once

// Private to the library: the ground below the lowest points of cells.
#include <cstddef>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "reconstruction/dem/raster.h"
#include "reconstruction/dem/surface_pins.h"

namespace groundray {

/// Where the cells of a raster lie: cell (column, row) covers the square of `cell_m` that begins at
/// origin_m + (column, row) * cell_m.
struct CellFrame {
  glm::dvec2 origin_m{0};
  double cell_m = 1;
  glm::ivec2 cells{0};

  /// Returns a place in cells from the middle of the first cell.
  glm::dvec2 from_first(const glm::dvec3& p) const noexcept {
    return (glm::dvec2(p) - origin_m) / cell_m - 0.5;
  }
};

/// The lowest point of each cell; of points as low as each other the first in x, then in y.
/// @param points_m  within the frame.
SurfacePins lowest_points(std::span<const glm::dvec3> points_m, const CellFrame& frame);

/// How the lowest points are told apart.
struct SurfaceRules {
  double cell_m = 1;
  double slope = 0.15;
  double pit_slope = 5;
  int radius_cells = 18;
  int net_cells = 0;
};

/// The ground below the lowest points.
struct GroundSurface {
  Raster height_m;
  Raster slope;  ///< of the surface: rise over run
  std::size_t pit_cells = 0;
  std::size_t object_cells = 0;
};

/// Drops pits and objects from `lowest` and returns the surface through what stays.
/// @param progress  told the share that is done, 0 to 1.
GroundSurface ground_below(SurfacePins lowest, const SurfaceRules& rules,
                           const std::function<void(double)>& progress);

}  // namespace groundray
