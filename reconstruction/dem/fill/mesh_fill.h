#pragma once

#include <cstddef>
#include <span>

#include "core/geometry/grid_frame.h"
#include "reconstruction/dem/fill/dem_fill.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Fills holes of a DEM by meshes: the surrounding ground becomes triangles (split as HeightGrid's
/// cells are), their holes are filled by fill_holes (triangulated, refined, faired), and the result
/// is resampled. It is an alternative to fill_dem, for comparison and for boundaries that are so
/// steep or overhanging that no surface of heights joins them: of several heights at a sample the
/// lowest is used. Ground steeper than one in two on average is flattened to that meanwhile. Gives
/// no sd.
///
/// The time grows at least with the square of the edges of a boundary: see HoleLimits. options.form
/// is not used.
/// @param most_edges  largest number of edges of a boundary; holes with more stay open, with the
///        fate Partly.
/// @throws Error as fill_dem and fill_holes.
FilledHeights fill_dem_by_mesh(const GridFrame& frame, std::span<const float> heights_m,
                               const FillOptions& options, std::size_t most_edges,
                               const RunControl& work = {});

}  // namespace groundray
