#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/mesh/merge/cover_surface.h"
#include "reconstruction/mesh/merge/redundant_faces.h"
#include "reconstruction/mesh/merge/stitched_mesh.h"
#include "reconstruction/mesh/merge/visibility_conflict.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Crossing of an edge with the boundary of a surface that covers one of its ends.
struct BorderCrossing {
  std::uint32_t inside = 0, outside = 0;  ///< ends of the edge
  /// Ends of the boundary edge; `no_vertex` where edge and surface separate away from a boundary.
  std::uint32_t from = no_vertex, to = no_vertex;
  double share = 0;  ///< position along the boundary edge, 0 to 1
};

/// Coverage of a merged mesh's vertices by a surface, and crossings of its edges.
struct BorderCrossings {
  std::vector<Cover> covers;              ///< of each vertex
  std::vector<BorderCrossing> crossings;  ///< one for each edge with exactly one end inside
};

/// Finds the crossings of edges with a surface's boundary. Edges that cross it more than once are
/// first split between the crossings, as far as samples a few triangle sizes apart show these.
/// Vertices that are not shared count as not covered.
BorderCrossings find_border_crossings(StitchedMesh& stitched, const CoverSurface& surface);

/// Counts of a sewing step.
struct ZipperingCounts {
  std::size_t covered = 0;   ///< triangles omitted because the merged mesh covers them
  std::size_t clipped = 0;   ///< triangles cut at the merged mesh's boundary
  std::size_t left_out = 0;  ///< triangles removed so that the mesh is manifold
};

/// Zippers a patch onto the merged mesh. Triangles that the merged mesh covers are omitted, the
/// others are clipped at its boundary, where both get vertices of each other, so that they share
/// the seam. Crossings nearer to a boundary vertex than a quarter of both edges are snapped to it.
/// If patch and merged mesh separate away from a boundary, the patch extends one triangle farther.
/// Only triangles with shared vertices cover others.
/// @param stitched  surface with boundaries, as from make_manifold, before and after.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994), section 4.2.
ZipperingCounts zipper(StitchedMesh& stitched, StitchedMesh patch, const CoverTolerance& limits);

/// Fills slits: narrow loops of at most eight boundary edges whose filling triangles lie on a
/// scanned surface. The sides of a slit may overlap slightly; the outline of a patch is not a slit.
/// @param seen  the scanned surfaces; their refuted triangles are ignored.
/// @return number of triangles added.
std::size_t fill_slits(StitchedMesh& stitched, std::span<const RatedSurface> seen,
                       const RunControl& work);

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
