#pragma once

// Private to the library: the ground surface from the lowest points of cells.
#include <cstddef>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "reconstruction/dem/ground/raster.h"
#include "reconstruction/dem/ground/surface_pins.h"

namespace groundray {

/// Positions of a raster's cells: cell (column, row) covers the square of `cell_m` that begins at
/// origin_m + (column, row) * cell_m.
struct CellFrame {
  glm::dvec2 origin_m{0};
  double cell_m = 1;
  glm::ivec2 cells{0};

  /// Returns a position in cells from the centre of the first cell.
  glm::dvec2 from_first(const glm::dvec3& p) const noexcept {
    return (glm::dvec2(p) - origin_m) / cell_m - 0.5;
  }
};

/// Returns the lowest point of each cell; of equally low points the first in x, then in y.
/// @param points_m  within the frame.
SurfacePins lowest_points(std::span<const glm::dvec3> points_m, const CellFrame& frame);

/// Parameters of the ground surface; see GroundFilterOptions.
struct SurfaceRules {
  double cell_m = 1;
  double slope = 0.15;
  double pit_slope = 5;
  int radius_cells = 18;
  int net_cells = 0;
};

/// Ground surface, and the cells excluded from it.
struct GroundSurface {
  Raster height_m;
  Raster slope;  ///< rise over run of the surface
  std::size_t pit_cells = 0;
  std::size_t object_cells = 0;
};

/// Removes pits and objects from `lowest` and returns the surface through the remaining points.
/// @param progress  receives the fraction that is done, 0 to 1.
GroundSurface ground_below(SurfacePins lowest, const SurfaceRules& rules,
                           const std::function<void(double)>& progress);

}  // namespace groundray
