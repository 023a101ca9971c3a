#pragma once

#include <cstddef>
#include <span>

#include "reconstruction/scan/scan_mesh.h"
#include "reconstruction/work.h"

namespace groundray {

/// When surfaces of two scans are taken for one.
struct MergeLimits {
  double noise_sds = 3;     ///< apart by at most so many standard deviations of both,
  double apart_m = 0;       ///< and this besides: what poses are off
  double turned_rad = 1.2;  ///< between normals, at most; of patches, for triangles are noisy
  /// How far, for each metre of its longest edge, a triangle may be from the surface between its
  /// corners: where another scan saw what a long triangle bridges, the triangle goes.
  double interpolation = 0.1;
};

/// What merging did.
struct MergeCounts {
  std::size_t redundant = 0;     ///< triangles left out, for another scan saw the place better
  std::size_t seen_through = 0;  ///< triangles left out, for beams of another scan passed them
  std::size_t clipped = 0;       ///< triangles cut at borders of others
  std::size_t filled = 0;        ///< triangles added where cutting left slits
  std::size_t bridged = 0;       ///< triangles added over gaps that single scans leave
  std::size_t moved = 0;         ///< vertices moved to the consensus of several scans
  /// Triangles left out for with them there would be no surface: edges of more than two triangles,
  /// neighbours of opposite windings, vertices named twice.
  std::size_t left_out = 0;
};

/// Scans as one mesh. Each edge has one triangle or two, whose windings agree, and the triangles at
/// each vertex are one fan.
struct MergedMesh {
  MeasuredMesh mesh;
  MergeCounts counts;
};

/// Merges scans that are in one frame. Where several saw the same surface the triangles of the one
/// that saw it best are kept, the others' are cut at their border and share its vertices, gaps
/// between borders that are no longer than the triangles beside them are bridged, and each vertex
/// moves along its normal to where all scans have the surface in the mean. Of one scan nothing
/// moves: it is made the surface that MergedMesh is, in little time. Does not depend on the number
/// of threads.
/// @param scans  in any order, which matters where two are worth the same. Standard deviations,
///               labels and confidences are carried along if any scan has them; labels and
///               confidences of a scan that has none are 0 and 1. A standard deviation of 0, or
///               none, is one that is not known: where any is, it is taken to be the median of its
///               scan's others or, where a scan knows none, that of the noisiest scan, so that what
///               is not known never counts for more than what is.
/// @throws Error naming every fault of a scan or of the limits, or if it takes too much memory.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994).
MergedMesh merge(std::span<const ScanMesh> scans, const MergeLimits& limits, const Work& work = {});

}  // namespace groundray
