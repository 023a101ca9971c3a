#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/scene/calibration/camera_calibration.h"
#include "apps/scene/scene_spec.h"
#include "core/geometry/trajectory.h"
#include "core/image/image.h"
#include "core/tracing/instance_box.h"
#include "core/tracing/scene.h"
#include "sensors/camera/camera.h"
#include "sensors/lidar/lidar.h"
#include "sensors/lidar/pattern/scan_pattern.h"
#include "sensors/sky/atmosphere.h"
#include "sensors/sky/sky.h"
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

/// Returns the first time of a recorded trajectory, on the recorder's clock.
/// @throws Error as read_tum.
std::chrono::nanoseconds begin_time(const RecordedPath& path);

/// Returns a recorded trajectory in D.
/// @param begin  time 0 of the run, on the recorder's clock.
/// @throws Error as read_tum.
Trajectory recorded_path(const RecordedPath& path, const Terrain& terrain,
                         std::chrono::nanoseconds begin);

/// Returns the trajectory in D of an object that drives for the duration of a run.
/// @throws Error as build_ground_path.
Trajectory driven_path(const DrivenPath& path, const Terrain& terrain,
                       std::chrono::nanoseconds duration);

/// Lidar of a run, with its trajectory and the number of its scans.
struct PlacedLidar {
  MountedLidar spec;
  Lidar lidar;
  Trajectory X_DS;
  std::int64_t sweeps = 0;  ///< number of whole sweeps within the run
};

/// Camera of a run, with its trajectory and the times of its images.
struct PlacedCamera {
  MountedCamera spec;
  Camera camera;
  Trajectory X_DC;
  std::vector<std::chrono::nanoseconds> begins;  ///< start times of its images within the run
  std::optional<Rectification> rectification;    ///< present for a camera of a stereo pair
  ImageF pupil_sr;  ///< result of pupil_sr(), if there is an imager and an aperture
};

/// Objects and ground cover of a scene, built for tracing.
struct SceneObjects {
  /// Objects of one entry of the scene file, with consecutive instance numbers from `first`.
  struct Group {
    std::string name;
    std::uint16_t label = 0;
    std::uint32_t first = 1;
    std::uint32_t count = 0;
  };

  GroundCover cover;  ///< empty if the ground has a single material without an image
  ObjectTracer objects;
  InstanceBoxes boxes;  ///< of `objects`
  std::vector<ModelTruth> models;
  std::vector<ModelScene> shapes;  ///< distinct shapes of the models
  Materials materials;             ///< materials of the ground, if it has any, then of the models
  std::vector<Group> groups;
  std::string fingerprint;       ///< equal texts imply equal objects and equal cover
  std::size_t memory_bytes = 0;  ///< memory of all this, in the form that is traced
};

/// Loads and builds the objects and the ground cover of a scene.
/// @param begin  time 0 of the run, on the clock of recorded paths.
/// @throws Error naming the entry if a file is invalid; if an object has no ground under it, drives
///         off it or has a path that misses the run; or if a surface has no material, but there are
///         cameras or lidars with light.
SceneObjects build_scene_objects(const SceneSpec& spec, const Terrain& terrain,
                                 std::chrono::nanoseconds begin);

/// Scene with its files loaded and its trajectories computed: everything that a run needs.
struct Simulation {
  SceneSpec spec;
  Terrain terrain;
  std::chrono::nanoseconds begin{0};  ///< time 0 of the run, on the clock of a recorded trajectory
  std::vector<PlacedLidar> lidars;
  std::vector<PlacedCamera> cameras;
  double reach_m = 0;  ///< largest half diagonal, in plan, of the sensor_box() of a frame
  SceneObjects scene_objects;
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

/// Returns the folder with groundray's own data: $GROUNDRAY_DATA, or that in own_folder().
std::filesystem::path data_folder();

/// Loads a scene and all files that it names.
/// @param seed   replaces the scene's own.
/// @param world  chooses one of the worlds of the scene (docs/reference/sampling.md).
/// @throws Error if a file is invalid; if the platform's trajectory ends before the run; if a
///         sensor is below ground at any time, or never within reach of the DEM; if the run is too
///         short for one sweep or one image; if a stereo pair cannot be rectified; if a camera is
///         in two pairs or is triggered during an exposure; or as pupil_sr.
Simulation load_simulation(const std::filesystem::path& scene,
                           std::optional<Seed> seed = std::nullopt,
                           std::optional<std::uint32_t> world = std::nullopt);

/// Builds a scene that has been parsed, as load_simulation.
/// @param progress  called from time to time during a long preparation of the terrain, with the
///                  fraction that is done; an exception that it throws ends the preparation and
///                  reaches the caller. May be empty.
Simulation build_simulation(SceneSpec spec, const Terrain::Progress& progress = {});

}  // namespace groundray
