#pragma once

#include <cstddef>
#include <span>

#include "reconstruction/mesh/merge/cover_surface.h"
#include "reconstruction/mesh/merge/redundant_faces.h"
#include "reconstruction/mesh/merge/stitched_mesh.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Counts of a sewing step.
struct ZipperingCounts {
  std::size_t covered = 0;   ///< triangles omitted because the merged mesh covers them
  std::size_t clipped = 0;   ///< triangles cut at the merged mesh's boundary
  std::size_t left_out = 0;  ///< triangles removed so that the mesh is manifold
};

/// Zippers a patch onto the merged mesh. Triangles that the merged mesh covers are omitted, the
/// others are clipped at its boundary. There the patch gets the boundary's vertices, and the
/// boundary gets vertices where the patch's edges cross it, so that both share the seam. A crossing
/// is snapped to a boundary vertex that is nearer than a quarter of the boundary edge and of the
/// crossing edge. If patch and merged mesh separate away from a boundary, the patch extends one
/// triangle farther. Only triangles with shared vertices cover others.
/// @param stitched  surface with boundaries, as from make_manifold, before and after.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994), section 4.2.
ZipperingCounts zipper(StitchedMesh& stitched, StitchedMesh patch, const CoverTolerance& limits);

/// Fills slits: narrow loops of at most eight boundary edges whose filling triangles lie on a
/// scanned surface. The sides of a slit may overlap slightly; the outline of a patch is not a slit.
/// @param seen  the scanned surfaces; their refuted triangles are ignored.
/// @return number of triangles added.
std::size_t fill_slits(StitchedMesh& stitched, std::span<const RatedSurface> seen,
                       const RunControl& work);

}  // namespace groundray
