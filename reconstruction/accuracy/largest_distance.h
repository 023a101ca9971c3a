#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

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

/// A part of a triangle, and a triangle of the other surface near it.
struct SearchPiece {
  std::array<glm::dvec3, 3> corners;
  std::uint32_t triangle = 0;
  std::uint32_t near = 0;
  double at_most_m = std::numeric_limits<double>::infinity();  ///< what is known already
};

/// How long a search goes on.
struct SearchLimits {
  double tolerance_m = 0;  ///< between the bounds
  double rounding_m = 0;   ///< of distances; differences below it mean nothing
  std::size_t most_pieces = 0;
  double enough_m = std::numeric_limits<double>::infinity();  ///< no search beyond what is farther
};

/// Searches a surface for the point farthest from another by branch and bound, best first.
/// @see Tang, Lee, Kim, Interactive Hausdorff distance computation for general polygonal models,
///      ACM Transactions on Graphics 28(3) (2009): bounds by the nearest triangles of corners.
FarthestProbe find_farthest(const TriangleMesh& from, const ClosestPoint& to,
                            const SearchLimits& limits);

/// As above, among some pieces alone.
/// @param so_far  what is known of the rest, and of the point farthest among all.
FarthestProbe find_farthest(const std::vector<SearchPiece>& pieces, const ClosestPoint& to,
                            const FarthestProbe& so_far, const SearchLimits& limits);

}  // namespace groundray
