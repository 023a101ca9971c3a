#pragma once

// Private to the library: a surface through scattered points.
#include "reconstruction/dem/raster.h"

namespace groundray {

/// What is known of a surface: at most one point in each cell. NaN in all three where there is
/// none.
struct SurfacePins {
  Raster height_m;
  Raster right_cells;  ///< the point's place in plan, from the cell's middle
  Raster up_cells;     ///< likewise, towards the next row

  SurfacePins() = default;
  explicit SurfacePins(glm::ivec2 cells) : height_m(cells), right_cells(cells), up_cells(cells) {}
};

/// Where a point counts.
enum class PinPlace {
  Measured,  ///< where it is: its height is carried to the cell's middle along the surface
  Middle     ///< as if it were there: does not go beyond the heights around cliffs and trees
};

/// Returns heights of all cells' middles: a surface that passes through the points and is smooth
/// between them, near to the membrane that hangs from them (its height is the mean of its
/// neighbours'). Measured planes stay planes within the points; beyond them the surface levels out.
/// Nearly linear in the cells: solved coarse to fine, without going on until nothing changes.
/// @param pins  one at least.
/// @see Bornemann and Deuflhard, The cascadic multigrid method for elliptic problems (1996).
Raster membrane_through(const SurfacePins& pins, PinPlace place);

}  // namespace groundray
