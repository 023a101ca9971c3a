#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/tracing/closest_point.h"

namespace groundray {

/// Point of a surface and its distance from another surface, exact except for rounding.
struct Probe {
  glm::dvec3 p{0};
  double distance_m = 0;
  std::uint32_t nearest = 0;  ///< triangle of the other surface
};

/// Result of a search for the largest distance.
struct FarthestProbe {
  Probe probe;
  std::uint32_t triangle = 0;  ///< of the searched surface
  double at_most_m = 0;        ///< upper bound of all distances, except for rounding
  std::size_t pieces = 0;      ///< pieces examined
};

/// Part of a triangle, and a triangle of the other surface near it.
struct SearchPiece {
  std::array<glm::dvec3, 3> corners;
  std::uint32_t triangle = 0;
  std::uint32_t near = 0;
  double at_most_m = std::numeric_limits<double>::infinity();  ///< upper bound known so far
};

/// Stopping criteria of a search.
struct SearchLimits {
  double tolerance_m = 0;  ///< between the bounds
  double rounding_m = 0;   ///< rounding error of distances; smaller differences are ignored
  std::size_t most_pieces = 0;
  double enough_m =
      std::numeric_limits<double>::infinity();  ///< stops at the first larger distance
};

/// Finds the point of a surface farthest from another by best-first branch and bound.
/// @see Tang, Lee, Kim, Interactive Hausdorff distance computation for general polygonal models,
///      ACM Transactions on Graphics 28(3) (2009): bounds by the nearest triangles of corners.
FarthestProbe find_farthest(const TriangleMesh& from, const ClosestPoint& to,
                            const SearchLimits& limits);

/// Overload restricted to some pieces.
/// @param so_far  upper bound of the rest of the surface, and the farthest point known so far.
FarthestProbe find_farthest(const std::vector<SearchPiece>& pieces, const ClosestPoint& to,
                            const FarthestProbe& so_far, const SearchLimits& limits);

}  // namespace groundray
