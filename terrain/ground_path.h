#pragma once

#include <chrono>
#include <glm/vec2.hpp>
#include <vector>

#include "core/height_grid.h"
#include "core/trajectory.h"

namespace groundray {

/// How a vehicle drives over the ground.
struct GroundPathSpec {
  std::vector<glm::dvec2> waypoints_m;     ///< in D; the path is a smooth curve through them, in order
  double speed_m_s = 1;                    ///< along the curve
  double height_m = 0;                     ///< of body frame B's origin above the ground below it
  glm::dvec2 footprint_m{2, 1.5};          ///< wheel base and track: the ground under the wheels sets pitch and roll
  std::chrono::nanoseconds duration{0};    ///< how long to drive
};

/// Returns the path X_DB of a vehicle that follows the ground: a centripetal Catmull-Rom curve through the waypoints at
/// constant speed, at a height over the ground, pitching and rolling with it. One pose each 10 ms.
/// @throws Error if the waypoints are fewer than two or too close, the curve is shorter than the drive, or a wheel
///         would stand outside the DEM or in a hole.
Trajectory build_ground_path(const HeightGrid& ground, const GroundPathSpec& spec);

}  // namespace groundray
