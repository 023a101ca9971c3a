#pragma once

#include <chrono>
#include <cstdint>

#include "apps/scene/scene_spec.h"
#include "core/geometry/trajectory.h"
#include "sensors/lidar/pattern/scan_pattern.h"
#include "terrain/terrain.h"

namespace groundray {

/// Converts a time to seconds.
inline double in_seconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

/// Returns the duration of a scene's run.
std::chrono::nanoseconds run_time(const SceneSpec& spec);

/// Returns the number of whole sweeps in a scene's run, allowing for rounding of the duration
/// (0.3 s at 10 Hz has three).
std::int64_t whole_sweeps(const ScanPattern& pattern, const SceneSpec& spec);

/// Returns a trajectory that continues the last motion until the end of the run's last sweep. This
/// may be after the run, because the times of firing sequences do not depend on it.
Trajectory extended(const Trajectory& path, const SceneSpec& spec);

/// Returns a recorded trajectory in D.
/// @param begin  time 0 of the run, on the recorder's clock.
/// @throws Error as read_tum.
Trajectory recorded_path(const RecordedPath& path, const Terrain& terrain,
                         std::chrono::nanoseconds begin);

/// Returns the trajectory in D of an object that drives for the duration of a run.
/// @throws Error as build_ground_path.
Trajectory driven_path(const DrivenPath& path, const Terrain& terrain,
                       std::chrono::nanoseconds duration);

}  // namespace groundray
