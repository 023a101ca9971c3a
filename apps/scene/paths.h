#pragma once

#include <chrono>
#include <cstdint>

#include "core/trajectory.h"
#include "sensors/scan_pattern.h"
#include "sensors/scene_spec.h"
#include "terrain/terrain.h"

namespace groundray {

/// Returns a time in seconds.
inline double in_seconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

/// How long a scene runs.
std::chrono::nanoseconds run_time(const SceneSpec& spec);

/// How many whole sweeps a scene's run has; those that a double only approximates (0.3 s at 10 Hz)
/// count.
std::int64_t whole_sweeps(const ScanPattern& pattern, const SceneSpec& spec);

/// Returns a path that goes on as it last moved until the last sweep of the run has ended: firing
/// sequences keep a time of their own, so that may be after the run.
Trajectory extended(const Trajectory& path, const SceneSpec& spec);

/// Returns a recorded path in D.
/// @param begin  time 0 of the run, on the recorder's clock.
/// @throws Error as read_tum.
Trajectory recorded_path(const RecordedPath& path, const Terrain& terrain,
                         std::chrono::nanoseconds begin);

/// Returns the path in D of what drives for the time of a run.
/// @throws Error as build_ground_path.
Trajectory driven_path(const DrivenPath& path, const Terrain& terrain,
                       std::chrono::nanoseconds duration);

}  // namespace groundray
