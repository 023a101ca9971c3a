#pragma once

#include <vector>

#include "core/mesh.h"

namespace groundray {

/// How far places are above or below a surface that does not hang over.
struct VerticalError {
  double largest_m = 0, mean_m = 0, rms_m = 0;
  /// Of the place that is farthest beyond the surface's border, as seen from above. Such places are
  /// measured at the border's nearest point.
  double aside_m = 0;
};

/// Measures it. The same for any number of threads.
/// @param places_m  at least one.
/// @param surface   every triangle of which is counter-clockwise as seen from above, in the same
///                  frame; its origin should not be much farther than it is large.
/// @throws Error naming every fault of the surface, as check_mesh.
VerticalError vertical_error(const std::vector<glm::dvec3>& places_m, const TriangleMesh& surface);

}  // namespace groundray
