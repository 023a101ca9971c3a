#pragma once

#include <chrono>

#include "core/trajectory.h"
#include "sensors/scene_spec.h"
#include "terrain/terrain.h"

namespace groundray {

/// How long a scene runs.
std::chrono::nanoseconds run_time(const SceneSpec& spec);

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
