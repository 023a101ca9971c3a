#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/tracing/closest_point.h"

namespace groundray {

/// Triangle that is not proved to be near enough to a surface.
struct Beyond {
  std::uint32_t triangle = 0;
  double distance_m = 0;      ///< of its farthest point found
  std::uint32_t nearest = 0;  ///< triangle of the surface nearest to that point
};

/// Returns, in order, the triangles of a surface that have a point farther than `most_m` from
/// another surface, or for which this cannot be decided, as within a thousandth of it. Every point
/// of all other triangles is within `most_m`, except for rounding. The result does not depend on
/// the number of threads.
/// @param from  in the frame of `to`.
/// @see find_farthest, which decides where a subdivision into a few parts does not.
std::vector<Beyond> find_beyond(const TriangleMesh& from, const ClosestPoint& to, double most_m);

}  // namespace groundray
