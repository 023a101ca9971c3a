#pragma once

// Private to the library: a surface through scattered points.
#include "reconstruction/dem/ground/raster.h"

namespace groundray {

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

}  // namespace groundray
