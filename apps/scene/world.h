#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "apps/scene/cameras.h"
#include "apps/scene/content.h"
#include "core/trajectory.h"
#include "sensors/aerial_perspective.h"
#include "sensors/lidar.h"
#include "sensors/scene_spec.h"
#include "sensors/sky.h"
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
  std::vector<PlacedCamera> cameras;
  double reach_m = 0;  ///< from the middle of any frame's sensor positions to the farthest, in plan
  Content content;
  std::optional<Sky> sky;
  std::optional<AerialPerspective> air;  ///< if it fades what cameras see
};

/// When a sensor makes a frame, and where it is meanwhile.
struct Exposed {
  const Trajectory* X_DS;
  std::chrono::nanoseconds begin, end;
};
Exposed exposed(const PlacedLidar& lidar, std::int64_t sweep);
Exposed exposed(const PlacedCamera& camera, std::int64_t image);

/// Returns the box of a sensor's positions during a frame, in D.
SensorBox sensor_box(const Exposed& frame);

/// Returns the first frame of a run: the first lidar's, or else the first camera's.
Exposed first_frame(const World& world);

/// The folder with groundray's own data: $GROUNDRAY_DATA, or beside the installed program or Python
/// module, or of the source tree.
std::filesystem::path data_folder();

/// Loads a scene and everything it names.
/// @throws Error if a file is at fault, the platform's path ends before the run, a sensor is below
///         ground on its way or never in reach of the DEM, the run is too short for one sweep or
///         one image, or a stereo pair cannot be rectified.
/// @param seed  instead of the scene's own.
World load_world(const std::filesystem::path& scene, std::optional<Seed> seed = std::nullopt);

/// As load_world, of a scene that is understood already.
/// @param progress  is told now and then which share of a long preparation of the terrain is done;
///                  what it throws ends that and reaches the caller. May be none.
World build_world(SceneSpec spec, const Terrain::Progress& progress = {});

}  // namespace groundray
