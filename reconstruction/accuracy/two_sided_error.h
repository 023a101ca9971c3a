#pragma once

#include "core/closest_point.h"
#include "core/mesh.h"
#include "core/ray_tracer.h"
#include "reconstruction/accuracy/accuracy.h"

namespace groundray {

/// How far two surfaces are from each other.
struct TwoSidedError {
  OneSidedError forth;  ///< from the first to the second
  OneSidedError back;   ///< from the second to the first

  /// Returns the Hausdorff distance.
  HausdorffDistance largest() const noexcept;
  /// Returns the larger mean of both ways, metres.
  double mean_m() const noexcept;
  /// Returns the larger root mean square of both ways, metres.
  double rms_m() const noexcept;
};

/// Measures how far two surfaces are from each other, as MeshDistance::error both ways. The same
/// for any number of threads.
/// @throws Error as MeshDistance and MeshDistance::error.
TwoSidedError two_sided_error(const TriangleMesh& first, const TriangleMesh& second,
                              const ErrorFineness& fineness = {},
                              const RayDevice& device = RayDevice());

/// As above, of meshes in one frame that are made ready already; their origin should not be much
/// farther than they are large.
TwoSidedError two_sided_error(const ClosestPoint& first, const ClosestPoint& second,
                              const ErrorFineness& fineness = {});

}  // namespace groundray
