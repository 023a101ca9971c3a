#pragma once

#include <cstddef>
#include <span>

#include "reconstruction/mesh/merge/cover_surface.h"
#include "reconstruction/mesh/merge/stitched_mesh.h"
#include "reconstruction/mesh/merge/visibility_conflict.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Bridges gaps that the links of single scans leave, for instance between rows of two scans, or
/// over a dip that is seen at grazing incidence. Adds triangles between boundaries, smallest
/// circumscribed circle first. Their edges are no longer than others at their corners, their
/// normals are within 30 degrees of each corner's, they overlap nothing, and no beam passed through
/// them.
/// @param stitched          surface with boundaries, as from make_manifold, before and after.
/// @param scans          scans whose beams are tested, as in find_passed.
/// @param interpolation  permitted distance of a triangle from the surface between its corners, per
///                       metre of its longest edge.
/// @return number of triangles added.
/// @see Cohen-Steiner, Da, A greedy Delaunay-based surface reconstruction algorithm, The Visual
///      Computer 20(1) (2004), for the order.
std::size_t bridge_gaps(StitchedMesh& stitched, std::span<const BeamSurface> scans,
                        const CoverTolerance& tolerance, double interpolation,
                        const RunControl& work);

}  // namespace groundray
