#pragma once

#include <span>
#include <vector>

#include "core/mesh.h"
#include "core/ray_tracer.h"
#include "reconstruction/accuracy/area_share.h"

namespace groundray {

/// How a mesh agrees with the truth, both surfaces, at one tolerance.
struct Agreement {
  double tolerance_m = 0;
  AreaShare precision;     ///< of the mesh, that is within the tolerance of the truth
  AreaShare completeness;  ///< of the truth, that is within the tolerance of the mesh

  /// Returns the harmonic mean of both, 0 where both are 0.
  AreaShare f1() const noexcept;
};

/// Measures precision and completeness of a mesh at some tolerances.
/// @param truth_weight  what places of the truth count, none for all alike: 0 for what could not be
///                      seen.
/// @throws Error as MeshDistance and MeshDistance::within.
/// @see Knapitsch, Park, Zhou, Koltun, Tanks and temples, ACM Transactions on Graphics 36(4)
///      (2017), section 5: precision, recall and F-score, there of points.
std::vector<Agreement> agreement(const TriangleMesh& mesh, const TriangleMesh& truth,
                                 std::span<const double> tolerances_m,
                                 const ShareFineness& fineness = {},
                                 const SurfaceWeight& truth_weight = {},
                                 const RayDevice& device = RayDevice());

}  // namespace groundray
