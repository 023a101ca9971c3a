#pragma once

// Private to the library: openings and closings by discs.
#include "reconstruction/dem/ground/raster.h"

namespace groundray {

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

}  // namespace groundray
