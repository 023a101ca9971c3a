#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

#include "core/closest_point.h"
#include "core/mesh.h"

namespace groundray {

/// A point of a surface and how far it is from another, as far as double arithmetic tells.
struct Probe {
  glm::dvec3 p{0};
  double distance_m = 0;
  std::uint32_t nearest = 0;  ///< triangle of the other surface
};

/// What a search for the largest distance found.
struct FarthestProbe {
  Probe probe;
  std::uint32_t triangle = 0;  ///< of the surface
  double at_most_m = 0;        ///< bounds all distances, but for rounding
  std::size_t pieces = 0;      ///< that were looked at
};

/// Searches a surface for the point farthest from another by branch and bound, best first.
/// @param rounding_m  of distances; differences below it mean nothing.
/// @see Tang, Lee, Kim, Interactive Hausdorff distance computation for general polygonal models,
///      ACM Transactions on Graphics 28(3) (2009): bounds by the nearest triangles of corners.
FarthestProbe find_farthest(const TriangleMesh& from, const ClosestPoint& to, double tolerance_m,
                            double rounding_m, std::size_t most_pieces);

}  // namespace groundray
