#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "apps/groundray/content.h"
#include "core/trajectory.h"
#include "sensors/lidar.h"
#include "sensors/scene_spec.h"
#include "terrain/terrain.h"

namespace groundray {

/// One lidar of a run: what it is, where it goes, how often it scans.
struct PlacedLidar {
  MountedLidar spec;
  Lidar lidar;
  Trajectory X_DS;
  std::int64_t sweeps = 0;  ///< whole sweeps within the run
};

/// A scene spec with its files read and its paths laid: all that is needed to run it.
struct World {
  SceneSpec spec;
  Terrain terrain;
  std::chrono::nanoseconds begin{0};  ///< time 0 of the run, on the clock of a recorded trajectory
  std::vector<PlacedLidar> lidars;
  double reach_m = 0;  ///< from the middle of any sweep's sensor positions to the farthest, in plan
  Content content;
};

/// Returns the box of a lidar's positions during a sweep, in D.
SensorBox sensor_box(const PlacedLidar& lidar, std::int64_t sweep);

/// The folder with groundray's own data: $GROUNDRAY_DATA, or beside the installed program, or of
/// the source tree.
std::filesystem::path data_folder();

/// Loads a scene and everything it names.
/// @throws Error if a file is at fault, the platform's path ends before the run, a sensor is below
/// ground on its way or
///         never in reach of the DEM, or the run is too short for one sweep.
World load_world(const std::filesystem::path& scene);

}  // namespace groundray
