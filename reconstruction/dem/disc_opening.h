#pragma once

// Private to the library: openings and closings by discs.
#include "reconstruction/dem/raster.h"

namespace groundray {

/// Returns the morphological opening of a raster by a disc: the highest surface below it that the
/// disc, held level, can touch everywhere from below. The disc holds the cells whose middles are
/// within the radius of its own; beyond the raster's border is nothing. What is narrower than the
/// disc and stands out upwards goes; planes stay but for their upper border.
/// @param surface  finite everywhere.
/// @see Soille, Morphological Image Analysis (2003), chapter 4; van Droogenbroeck and Talbot, Fast
/// computation of morphological operations with arbitrary structuring elements (1996).
Raster opened_by_disc(const Raster& surface, int radius_cells);

/// As opened_by_disc, upside down: the lowest surface above `surface` that the disc can touch
/// everywhere from above.
Raster closed_by_disc(const Raster& surface, int radius_cells);

}  // namespace groundray
