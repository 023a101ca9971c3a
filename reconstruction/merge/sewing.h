#pragma once

#include <cstddef>
#include <span>

#include "reconstruction/merge/cover_surface.h"
#include "reconstruction/merge/quilt.h"
#include "reconstruction/merge/redundant_faces.h"
#include "reconstruction/work.h"

namespace groundray {

/// What sewing did.
struct SewingCounts {
  std::size_t covered = 0;   ///< triangles left out, for the quilt covers them
  std::size_t clipped = 0;   ///< triangles cut at the quilt's border
  std::size_t left_out = 0;  ///< triangles left out, for with them there would be no surface
};

/// Sews a patch onto a quilt. What the quilt covers of the patch is left out, the rest cut along
/// the quilt's border: there, it gets the border's vertices, and the border vertices where the
/// patch's edges cross it, so that both share the seam. A crossing nearer to a vertex of the border
/// than a quarter of the lengths of the border's edge and of its own is put there. Where patch and
/// quilt part company away from a border the patch goes on a triangle farther. Only triangles with
/// shared vertices cover others.
/// @param quilt  a surface with borders, as make_manifold gives, and so it is again.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994), section 4.2.
SewingCounts sew(Quilt& quilt, Quilt patch, const CoverTolerance& limits);

/// Fills slits: narrow loops of at most eight edges, where triangles between them are on a surface
/// that was seen. The sides of a slit may overlap a little; the outline of a patch is no slit.
/// @param seen  the surfaces that were, but for what is refuted.
/// @return the number of triangles added.
std::size_t fill_slits(Quilt& quilt, std::span<const RatedSurface> seen, const Work& work);

}  // namespace groundray
