#pragma once

#include <chrono>
#include <glm/vec2.hpp>
#include <vector>

#include "core/geometry/trajectory.h"
#include "terrain/ground.h"

namespace groundray {

/// Drive of a vehicle over the ground.
struct GroundPathSpec {
  std::vector<glm::dvec2> waypoints_m;  ///< in D; the path is a smooth curve through them, in order
  double speed_m_s = 1;                 ///< speed along the curve, in plan
  double height_m = 0;             ///< of body frame B's origin above the ground directly below it
  glm::dvec2 footprint_m{2, 1.5};  ///< wheel base and track, in plan
  std::chrono::nanoseconds duration{0};  ///< duration of the drive
  glm::dvec2 origin_w_m{0};              ///< position of D in W, for messages
  double from_m = 0;                     ///< arc length at which the drive starts
};

/// Returns the trajectory X_DB of a vehicle that follows the ground for [0, duration]: a pose every
/// 10 ms and one at the end. In plan, the vehicle moves at constant speed along a centripetal
/// Catmull-Rom curve through the waypoints, heading along the tangent. The curve starts and ends in
/// the direction of its first and last chord. Pitch and roll are those of the plane that best fits
/// the ground under the four wheels.
/// @throws Error if a value is out of bounds, if waypoints are closer than 1 cm, if the curve turns
///         back on itself at a waypoint or is shorter than the drive, or if the vehicle's centre or
///         a wheel would be outside the DEM or in a hole.
/// @see Yuksel, Schaefer, Keyser, Parameterization and applications of Catmull-Rom curves (2011):
///      the centripetal curve has no cusps or loops between waypoints.
Trajectory build_ground_path(const Ground& ground, const GroundPathSpec& spec);

}  // namespace groundray
