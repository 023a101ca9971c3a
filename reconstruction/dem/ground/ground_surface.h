#pragma once

// Private to the library: the ground surface from the lowest points of cells.
#include <algorithm>
#include <cstddef>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "reconstruction/dem/ground/ground_filter.h"

namespace groundray {

/// Numbers of the cells of a rectangle, in row order; NaN for none.
struct Raster {
  glm::ivec2 size{0};  ///< columns and rows
  std::vector<float> values;

  Raster() = default;
  explicit Raster(glm::ivec2 cells, float value = std::numeric_limits<float>::quiet_NaN())
      : size(cells),
        values(static_cast<std::size_t>(cells.x) * static_cast<std::size_t>(cells.y), value) {}

  std::size_t index(int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(size.x) +
           static_cast<std::size_t>(column);
  }
  float operator()(int column, int row) const noexcept { return values[index(column, row)]; }
  float& operator()(int column, int row) noexcept { return values[index(column, row)]; }
  const float* row(int row) const noexcept { return values.data() + index(0, row); }
  float* row(int row) noexcept { return values.data() + index(0, row); }
};

/// Returns the bilinear interpolation between the four cell centres around a position, in cells
/// from the first cell's centre; outside, that at the nearest position on the border.
inline float between_cells(const Raster& raster, float x, float y) noexcept {
  const int last_column = raster.size.x - 1, last_row = raster.size.y - 1;
  x = std::clamp(x, 0.f, static_cast<float>(last_column));
  y = std::clamp(y, 0.f, static_cast<float>(last_row));
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const int next = std::min(column + 1, last_column);
  const float *low = raster.row(row), *high = raster.row(std::min(row + 1, last_row));
  const float u = x - static_cast<float>(column), v = y - static_cast<float>(row);
  const float below = low[column] + u * (low[next] - low[column]);
  return below + v * (high[column] + u * (high[next] - high[column]) - below);
}

/// Returns the morphological opening of a raster by a disc: the upper envelope of all level discs
/// that fit below the surface. The disc consists of the cells whose centres are within the radius
/// of its own centre; cells beyond the raster's edge are ignored. Features that stand out upwards
/// and are narrower than the disc are removed; planes are preserved, except at their upper edge.
/// @param surface  finite everywhere.
/// @see Soille, Morphological Image Analysis (2003), chapter 4; van Droogenbroeck and Talbot, Fast
///      computation of morphological operations with arbitrary structuring elements (1996).
Raster opened_by_disc(const Raster& surface, int radius_cells);

/// Returns the morphological closing, the counterpart of opened_by_disc: the lower envelope of all
/// level discs that fit above the surface.
Raster closed_by_disc(const Raster& surface, int radius_cells);

/// Known points of a surface, at most one per cell; NaN in all three rasters where there is none.
struct SurfacePins {
  Raster height_m;
  Raster right_cells;  ///< position of the point in plan, from the cell's centre
  Raster up_cells;     ///< likewise, towards the next row

  SurfacePins() = default;
  explicit SurfacePins(glm::ivec2 cells) : height_m(cells), right_cells(cells), up_cells(cells) {}
};

/// Position at which the height of a point applies.
enum class PinPlace {
  Measured,  ///< that of the point: its height is carried to the cell's centre along the surface
  Middle     ///< the cell's centre: heights do not overshoot at cliffs and trees
};

/// Returns the heights at all cell centres of a surface that passes through the points and is
/// smooth between them, close to the membrane through them (its height is the mean of its
/// neighbours'). Measured planes are preserved between the points; beyond them the surface levels
/// out. The time is nearly linear in the number of cells: solved from coarse to fine, without
/// iterating to convergence.
/// @param pins  at least one.
/// @see Bornemann and Deuflhard, The cascadic multigrid method for elliptic problems (1996).
Raster membrane_through(const SurfacePins& pins, PinPlace place);

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

/// Ground surface, and the cells excluded from it.
struct GroundSurface {
  Raster height_m;
  Raster slope;  ///< rise over run of the surface
  std::size_t pit_cells = 0;
  std::size_t object_cells = 0;
};

/// Removes pits and objects from `lowest` and returns the surface through the remaining points.
/// @param progress  receives the fraction that is done, 0 to 1.
GroundSurface ground_below(SurfacePins lowest, const GroundFilterOptions& options,
                           const std::function<void(double)>& progress);

}  // namespace groundray
