#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "apps/scene/cameras.h"
#include "apps/scene/scene_objects.h"
#include "apps/scene/scene_spec.h"
#include "core/geometry/trajectory.h"
#include "sensors/lidar/lidar.h"
#include "sensors/sky/aerial_perspective.h"
#include "sensors/sky/sky.h"
#include "terrain/terrain.h"

namespace groundray {

/// Lidar of a run, with its trajectory and the number of its scans.
struct PlacedLidar {
  MountedLidar spec;
  Lidar lidar;
  Trajectory X_DS;
  std::int64_t sweeps = 0;  ///< number of whole sweeps within the run
};

/// Scene with its files loaded and its trajectories computed: everything that a run needs.
struct Simulation {
  SceneSpec spec;
  Terrain terrain;
  std::chrono::nanoseconds begin{0};  ///< time 0 of the run, on the clock of a recorded trajectory
  std::vector<PlacedLidar> lidars;
  std::vector<PlacedCamera> cameras;
  double reach_m = 0;  ///< largest half diagonal, in plan, of the sensor_box() of a frame
  SceneObjects content;
  std::optional<Sky> sky;
  std::optional<AerialPerspective> air;  ///< none if it does not attenuate
};

/// Time of a sensor's frame, with the sensor's trajectory.
struct Exposed {
  const Trajectory* X_DS;
  std::chrono::nanoseconds begin, end;
};
/// Returns the time and trajectory of a sweep.
Exposed exposed(const PlacedLidar& lidar, std::int64_t sweep);
/// Returns the time and trajectory of an image.
Exposed exposed(const PlacedCamera& camera, std::int64_t image);

/// Returns the box of a sensor's positions during a frame, in D.
SensorBox sensor_box(const Exposed& frame);

/// Returns the first frame of a run: the first lidar's, or else the first camera's.
Exposed first_frame(const Simulation& simulation);

/// Returns the folder with groundray's own data: $GROUNDRAY_DATA, or the one next to the installed
/// program or Python module, or that of the source tree.
std::filesystem::path data_folder();

/// Loads a scene and all files that it names.
/// @param seed  replaces the scene's own.
/// @throws Error if a file is invalid; if the platform's trajectory ends before the run; if a
///         sensor is below ground at any time, or never within reach of the DEM; if the run is too
///         short for one sweep or one image; or if a stereo pair cannot be rectified.
Simulation load_simulation(const std::filesystem::path& scene,
                           std::optional<Seed> seed = std::nullopt);

/// Builds a scene that has been parsed, as load_simulation.
/// @param progress  called from time to time during a long preparation of the terrain, with the
///                  fraction that is done; an exception that it throws ends the preparation and
///                  reaches the caller. May be empty.
Simulation build_simulation(SceneSpec spec, const Terrain::Progress& progress = {});

}  // namespace groundray
