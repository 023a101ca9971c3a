#pragma once

#include <vector>

#include "core/mesh.h"

namespace groundray {

/// How far a place is above or below a surface, as seen from above.
struct VerticalDistance {
  /// From the triangle that covers the place; of several storeys, from the nearest. Where none does
  /// from the border's nearest point in the plan; where those of several triangles are equally
  /// near, but for rounding, from that which is nearest in height.
  double above_m = 0;
  double aside_m = 0;  ///< beyond the border; 0 where a triangle covers the place
};

/// How far places are above or below a surface that does not hang over: see VerticalDistance.
struct VerticalError {
  double largest_m = 0, mean_m = 0, rms_m = 0;
  double aside_m = 0;  ///< of the place that is farthest beyond the surface's border
};

/// Measures it of each place. The same for any number of threads.
/// @param places_m  at least one.
/// @param surface   every triangle of which is counter-clockwise as seen from above, in the same
///                  frame; its origin should not be much farther than it is large. Parts of it may
///                  lie above each other.
/// @throws Error naming every fault of the surface, as check_mesh.
std::vector<VerticalDistance> vertical_distances(const std::vector<glm::dvec3>& places_m,
                                                 const TriangleMesh& surface);

/// Sums up what was measured, of at least one place.
VerticalError sum_up(const std::vector<VerticalDistance>& distances);

/// Measures it of all places, as vertical_distances.
VerticalError vertical_error(const std::vector<glm::dvec3>& places_m, const TriangleMesh& surface);

}  // namespace groundray
