#pragma once

#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/tracing/closest_point.h"
#include "core/tracing/ray_tracer.h"
#include "reconstruction/mesh/accuracy/accuracy.h"

namespace groundray {

/// Agreement of a mesh with the true surface at one tolerance.
struct Agreement {
  double tolerance_m = 0;
  AreaShare precision;     ///< fraction of the mesh that is within the tolerance of the truth
  AreaShare completeness;  ///< fraction of the truth that is within the tolerance of the mesh

  /// Returns the harmonic mean of both, 0 if both are 0.
  AreaShare f1() const noexcept;
};

/// Measures the precision and completeness of a mesh at each tolerance.
/// @param truth_weight  weight of each point of the truth, uniform if empty; 0 for what could not
///                      be seen.
/// @throws Error as MeshDistance and MeshDistance::within.
/// @see Knapitsch, Park, Zhou, Koltun, Tanks and temples, ACM Transactions on Graphics 36(4)
///      (2017), section 5: precision, recall and F-score, defined there for points.
std::vector<Agreement> agreement(const TriangleMesh& mesh, const TriangleMesh& truth,
                                 std::span<const double> tolerances_m,
                                 const ShareFineness& fineness = {},
                                 const SurfaceWeight& truth_weight = {},
                                 const RayDevice& device = RayDevice());

/// Distances between two surfaces in both directions.
struct TwoSidedError {
  OneSidedError forth;  ///< from the first to the second
  OneSidedError back;   ///< from the second to the first

  /// Returns the bounds of the Hausdorff distance.
  HausdorffDistance largest() const noexcept;
  /// Returns the larger mean of both directions, m.
  double mean_m() const noexcept;
  /// Returns the larger root mean square of both directions, m.
  double rms_m() const noexcept;
};

/// Measures the distances between two surfaces in both directions by MeshDistance::error. The
/// result does not depend on the number of threads.
/// @throws Error as MeshDistance and MeshDistance::error.
TwoSidedError two_sided_error(const TriangleMesh& first, const TriangleMesh& second,
                              const ErrorFineness& fineness = {},
                              const RayDevice& device = RayDevice());

/// Overload for prepared meshes in one frame, whose origin should be no farther from them than
/// about their size.
TwoSidedError two_sided_error(const ClosestPoint& first, const ClosestPoint& second,
                              const ErrorFineness& fineness = {});

}  // namespace groundray
