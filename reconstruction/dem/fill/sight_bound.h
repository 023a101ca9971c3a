#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/grid_frame.h"
#include "reconstruction/mesh/scan/scan_mesh.h"

namespace groundray {

/// Beam from its origin to the point that it hit, in D: nothing stands between.
struct SightLine {
  glm::dvec3 origin_m{0};
  glm::dvec3 end_m{0};
};

/// Returns the upper bound of the ground at each sample of a frame, in row order: the lowest height
/// at which lines of sight pass above it, or NaN if none does. The bound is the sum of `margin_m`
/// and the lowest of:
///
/// - the height of a line at its foot point, the nearest to the sample in plan, if that lies on the
///   line and at most half a cell away, both measured in columns and rows: for oblong cells, half
///   of their longer side along it. The margin must cover the rise of the ground from the line to
///   the sample: half a cell times the slope.
/// - the height, exactly above the sample, of occlusion faces and of the planes between their sides
///   and the origins of the beams. This assumes that nothing stands between neighbouring beams:
///   behind a crest that rises above the beam that hit it and below the next beam that passed, a
///   face is too low, by up to the distance of these two beams there. Lines have no such error;
///   pass no faces for bounds that hold everywhere.
///
/// Upright lines and faces are ignored. The time is proportional to the number of cells that lines
/// and faces cross.
/// @param margin_m  for noise of the lines and the rise of the ground, 0 or more.
/// @throws Error naming every fault: a frame without samples, steps of 0, positions or a margin
///         that are not finite, faces with missing vertices or without origins.
/// @see reconstruction/mesh/scan/scan_mesh.h: link returns the faces.
std::vector<float> sight_bound(const GridFrame& frame, const OcclusionFaces& faces,
                               std::span<const SightLine> lines, double margin_m);

}  // namespace groundray
