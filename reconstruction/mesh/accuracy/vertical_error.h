#pragma once

#include <vector>

#include "core/geometry/mesh.h"

namespace groundray {

/// Vertical distance of a point from a surface.
struct VerticalDistance {
  /// Absolute vertical distance, m, to the triangle that covers the point in plan view; if several
  /// do, to the nearest. Where none does, the distance at the nearest boundary point in plan view;
  /// if several triangles are equally near there, except for rounding, to the one nearest in
  /// height.
  double above_m = 0;
  double aside_m = 0;  ///< horizontally beyond the boundary; 0 where a triangle covers the point
};

/// Summary of the vertical distances of points from a surface without overhangs: see
/// VerticalDistance.
struct VerticalError {
  double largest_m = 0, mean_m = 0, rms_m = 0;
  double aside_m = 0;  ///< largest horizontal distance beyond the surface's boundary
};

/// Measures the vertical distance of each point. The result does not depend on the number of
/// threads.
/// @param places_m  at least one.
/// @param surface   triangles are counter-clockwise as seen from above; in the frame of the points,
///                  whose origin should be no farther from the surface than about its size. Parts
///                  may lie above each other.
/// @throws Error listing every fault of the surface, as check_mesh.
std::vector<VerticalDistance> vertical_distances(const std::vector<glm::dvec3>& places_m,
                                                 const TriangleMesh& surface);

/// Returns the summary of measured distances, of at least one point.
VerticalError sum_up(const std::vector<VerticalDistance>& distances);

/// Measures the vertical distances of all points and returns their summary.
VerticalError vertical_error(const std::vector<glm::dvec3>& places_m, const TriangleMesh& surface);

}  // namespace groundray
