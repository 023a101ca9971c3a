#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/grid_frame.h"
#include "reconstruction/scan/scan_mesh.h"

namespace groundray {

/// A beam from where it began to where it met something, in D: nothing stands between.
struct SightLine {
  glm::dvec3 origin_m{0};
  glm::dvec3 end_m{0};
};

/// Returns of each sample of a frame, row by row, the least height at which lines of sight pass
/// above it, so that the ground is no higher: NaN where none does. Sums of `margin_m` and
///
/// - the height of a line at its foot point, the nearest to the sample in plan, if that lies on the
///   line and no more than half a cell away, both counted in columns and rows: where cells are
///   oblong, half of their longer side along it. What the ground rises from the line to the sample
///   the margin has to cover: half a cell times the slope.
/// - the height, exactly above the sample, of the planes of occlusion faces and of those between
///   their sides and where the beams began. That holds as far as nothing stands between
///   neighbouring beams: behind a crest which rises above the beam that met it and below the next
///   one that passed, a face is too low, by up to how far these two are apart there. Lines have no
///   such fault; give no faces for bounds that hold throughout.
///
/// Lines and faces that are upright count for nothing. Takes time in proportion to the cells that
/// lines and faces cross.
/// @param margin_m  for noise of the lines and what is said above; 0 or more.
/// @throws Error naming every fault: a frame without samples, steps of 0, places or a margin that
///         are not finite, faces with vertices that are not there or without origins.
/// @see reconstruction/scan/scan_mesh.h: link gives the faces.
std::vector<float> sight_bound(const GridFrame& frame, const OcclusionFaces& faces,
                               std::span<const SightLine> lines, double margin_m);

}  // namespace groundray
