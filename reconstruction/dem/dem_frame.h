#pragma once

#include "core/geometry/grid_frame.h"
#include "terrain/dem/density_map.h"

namespace groundray {

/// Returns the frame of the samples whose cells cover `area`. A sample is the centre of its cell;
/// the cells' boundaries are whole multiples of cell_m from D's origin. Rows run from north to
/// south, as in rasters.
/// @throws Error if the area is empty or not bounded, cell_m is not above 0, or there would be more
///         than 2^30 samples along a side.
GridFrame frame_over(const Area& area, double cell_m);

/// Returns the frame of the samples whose cells cover `area`, aligned with `like`: it contains all
/// samples of `like` in the area, and `finer` - 1 others between neighbours of these. Columns and
/// rows run as those of `like`.
/// @param finer  subdivisions of a step, at least 1.
/// @throws Error as frame_over, or if `finer` is below 1.
GridFrame frame_like(const GridFrame& like, const Area& area, int finer = 1);

/// @throws Error naming every fault of a frame: fewer than 2 columns or rows, a step of 0,
///         cells_per_m that is not its inverse, numbers that are not finite.
void refuse_faults(const GridFrame& frame);

}  // namespace groundray
