#pragma once

#include <cstddef>
#include <span>

#include "reconstruction/merge/cover_surface.h"
#include "reconstruction/merge/quilt.h"
#include "reconstruction/merge/seen_through.h"
#include "reconstruction/work.h"

namespace groundray {

/// Bridges gaps that links of single scans leave, as between rows of two scans, or over a dip that
/// is seen at grazing incidence: adds triangles between borders, the one with the smallest circle
/// round it first. The edges of each are no longer than others at its corners are, its normal is
/// within 30 degrees of each corner's, it lies over nothing, and no beam passed it.
/// @param quilt          a surface with borders, as make_manifold gives, and so it is again.
/// @param scans          whose beams are asked, as find_passed does.
/// @param interpolation  how far, for each metre of its longest edge, a triangle may be from the
///                       surface between its corners.
/// @return the number of triangles added.
/// @see Cohen-Steiner, Da, A greedy Delaunay-based surface reconstruction algorithm, The Visual
///      Computer 20(1) (2004), for the order.
std::size_t bridge_gaps(Quilt& quilt, std::span<const BeamSurface> scans,
                        const CoverTolerance& tolerance, double interpolation, const Work& work);

}  // namespace groundray
