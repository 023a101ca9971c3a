#pragma once

#include <cstddef>
#include <span>

#include "reconstruction/mesh/scan/scan_mesh.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Conditions under which surfaces of two scans are treated as one.
struct MergeLimits {
  double noise_sds = 3;     ///< largest distance, in units of the sum of both standard deviations
  double apart_m = 0;       ///< additional distance, for errors of the poses
  double turned_rad = 1.2;  ///< largest angle between normals, which are averaged over patches
  /// Permitted distance of a triangle from the surface between its corners, per metre of its
  /// longest edge. Long triangles are removed where another scan saw the surface that they bridge.
  double interpolation = 0.1;
};

/// Counts of a merge.
struct MergeCounts {
  std::size_t redundant = 0;  ///< triangles removed because another scan saw the surface better
  std::size_t visibility_conflicts = 0;  ///< triangles through which beams of another scan passed
  std::size_t clipped = 0;               ///< triangles cut at boundaries of other scans
  std::size_t filled = 0;                ///< triangles added to fill slits left by clipping
  std::size_t bridged = 0;               ///< triangles added over gaps in single scans
  std::size_t moved = 0;                 ///< vertices moved to the consensus of several scans
  /// Triangles removed so that the mesh is manifold: edges with more than two triangles, neighbours
  /// with opposite windings, repeated vertices.
  std::size_t left_out = 0;
};

/// Scans merged into one mesh. Each edge has one or two consistently wound triangles, and the
/// triangles at each vertex form a single fan.
struct MergedMesh {
  MeasuredMesh mesh;
  MergeCounts counts;
};

/// Merges scans that are in one frame. Where several saw the same surface, the triangles of the
/// scan that saw it best are kept; those of the others are clipped at its boundary and share its
/// vertices. Gaps between boundaries that are no longer than the adjacent triangles are bridged,
/// and each vertex moves along its normal to the weighted mean of all scans. A single scan is only
/// made manifold, without moving vertices. The result does not depend on the number of threads.
/// @param scans  in any order, which matters only between equal weights. Standard deviations,
///               labels and confidences are kept if any scan has them; scans without labels or
///               confidences get 0 and 1. A standard deviation that is 0 or missing is unknown. If
///               any is known, it is replaced by the median of its scan's known ones or, if the
///               scan has none, by that of the noisiest scan, so that unknown noise never gets more
///               weight than known noise.
/// @throws Error listing every fault of a scan or of the limits, or if it takes too much memory.
/// @see docs/theory/reconstruction.md; Turk, Levoy, Zippered polygon meshes (1994).
MergedMesh merge(std::span<const ScanMesh> scans, const MergeLimits& limits,
                 const RunControl& work = {});

}  // namespace groundray
