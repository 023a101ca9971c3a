#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/closest_point.h"
#include "core/mesh.h"

namespace groundray {

/// A triangle that is not known to be near enough to a surface.
struct Beyond {
  std::uint32_t triangle = 0;
  double distance_m = 0;      ///< of its farthest point that was found
  std::uint32_t nearest = 0;  ///< triangle of the surface, there
};

/// Returns those triangles of a surface which have a point farther than `most_m` from another
/// surface, or where that could not be told, as within a thousandth of it; in their order. Of all
/// others every point is as near, but for rounding. The same for any number of threads.
/// @param from  in the frame of `to`.
/// @see find_farthest, which proves what a look at some parts does not.
std::vector<Beyond> find_beyond(const TriangleMesh& from, const ClosestPoint& to, double most_m);

}  // namespace groundray
