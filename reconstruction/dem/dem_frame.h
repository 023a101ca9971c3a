#pragma once

#include "core/grid_frame.h"
#include "terrain/area.h"

namespace groundray {

/// Returns the frame of the samples whose cells cover `area`: a sample stands in the middle of a
/// cell, the cells' borders at whole multiples of cell_m from D's origin. Rows run north to south,
/// as those of rasters do.
/// @throws Error if the area is empty or not bounded, cell_m is not above 0, or there would be more
///         than 2^30 samples along a side.
GridFrame frame_over(const Area& area, double cell_m);

/// Returns the frame of the samples whose cells cover `area`, snapped to those of `like`: all of
/// the samples of `like` in the area are among them, and between neighbours of these `finer` - 1
/// others. Columns and rows run as those of `like`.
/// @param finer  >= 1.
/// @throws Error as frame_over, or if `finer` is below 1.
GridFrame frame_like(const GridFrame& like, const Area& area, int finer = 1);

/// @throws Error naming every fault of a frame: fewer than 2 columns or rows, a step of 0 or
///         cells_per_m that is not its inverse, numbers that are not finite.
void refuse_faults(const GridFrame& frame);

}  // namespace groundray
