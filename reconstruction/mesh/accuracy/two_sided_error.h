#pragma once

#include "core/geometry/mesh.h"
#include "core/tracing/closest_point.h"
#include "core/tracing/ray_tracer.h"
#include "reconstruction/mesh/accuracy/accuracy.h"

namespace groundray {

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
