#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/grid_frame.h"
#include "reconstruction/dem/ground_filter.h"

namespace groundray {

/// What is above the ground, sample by sample of a frame, row by row; a sample's cell reaches half
/// a step from it.
struct Overhangs {
  std::vector<std::uint16_t>
      surfaces;  ///< points lie on so many, one above the other; 0: no points
  std::vector<float>
      overhang_m;  ///< height in D of the lowest one that is clear of the ground; NaN
  /// Free height between it and the highest point of the ground's surface below it; NaN. A column
  /// of its own: overhang_m less a DEM's height is another one, since that is fitted, at the
  /// sample, and filled where an overhang hides the ground.
  std::vector<float> clearance_m;
};

/// Tells the surfaces of each cell apart: points of one surface leave no gap of more than `gap_m`
/// between their heights above the ground. What rises from the ground without such a gap, a bush or
/// a trunk, belongs to the ground's surface and overhangs nothing. In cells without a point on the
/// ground, clearance is that above `ground.surface`, and a surface is clear of it likewise. Points
/// below the ground or outside of the frame do not count.
/// @param points_m  those that `ground` was found of.
/// @throws Error if the numbers of points differ, the frame is unsound or gap_m is not positive.
Overhangs find_overhangs(std::span<const glm::dvec3> points_m, const GroundPoints& ground,
                         const GridFrame& frame, double gap_m);

}  // namespace groundray
