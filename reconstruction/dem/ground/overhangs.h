#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/grid_frame.h"
#include "reconstruction/dem/ground/ground_filter.h"

namespace groundray {

/// Surfaces above the ground, for each sample of a frame in row order; a sample's cell extends half
/// a step to each side.
struct Overhangs {
  /// Number of surfaces, one above the other; 0 without points.
  std::vector<std::uint16_t> surfaces;
  /// Height in D of the lowest surface that is clear of the ground; NaN for none.
  std::vector<float> overhang_m;
  /// Free height between that and the highest point of the ground's surface below it; NaN for none.
  /// It differs from overhang_m minus a DEM's height, which is fitted, refers to the sample, and is
  /// filled where an overhang hides the ground.
  std::vector<float> clearance_m;
};

/// Separates the surfaces of each cell: points of one surface leave no gap of more than `gap_m`
/// between their heights above the ground. Features that rise from the ground without such a gap,
/// such as a bush or a trunk, belong to the ground's surface and are no overhangs. In cells without
/// a ground point, clearance is measured from `ground.surface`, and surfaces must be clear of it
/// likewise. Points below the ground or outside the frame are ignored.
/// @param points_m  the points that `ground` was computed from.
/// @throws Error if the numbers of points differ, the frame is invalid or gap_m is not positive.
Overhangs find_overhangs(std::span<const glm::dvec3> points_m, const GroundPoints& ground,
                         const GridFrame& frame, double gap_m);

}  // namespace groundray
