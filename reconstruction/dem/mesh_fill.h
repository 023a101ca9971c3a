#pragma once

#include <cstddef>
#include <span>

#include "core/grid_frame.h"
#include "reconstruction/dem/dem_fill.h"
#include "reconstruction/work.h"

namespace groundray {

/// Fills blank areas of a DEM by meshes: the ground round about as triangles (split as HeightGrid's
/// cells are), its holes filled as fill_holes does (triangulated, refined, faired), resampled. It
/// is an alternative to fill_dem to compare with, and for rims that stand so steep or overhang that
/// a surface of heights is none of theirs: of what lies above a sample the lowest is taken. Ground
/// steeper than one in two on the mean is flattened to that meanwhile. Tells no sd.
///
/// Times grow with the square of a rim's edges and more: see HoleLimits. Options' form is not used.
/// @param most_edges  of a rim, at most; holes with a longer one stay, with the fate Partly.
/// @throws Error as fill_dem and fill_holes.
FilledHeights fill_dem_by_mesh(const GridFrame& frame, std::span<const float> heights_m,
                               const FillOptions& options, std::size_t most_edges,
                               const Work& work = {});

}  // namespace groundray
