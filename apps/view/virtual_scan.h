#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/scene/frames.h"
#include "apps/scene/simulation.h"
#include "core/geometry/pose.h"
#include "sensors/lidar/lidar.h"
#include "sensors/lidar/lidar_spec.h"
#include "terrain/scatter/scatter.h"

namespace groundray {

/// Lidar preset, which can be placed anywhere.
struct SensorPreset {
  std::string name;   ///< "velodyne_vlp16"
  std::string model;  ///< name for display: "Velodyne VLP-16"
  LidarSpec lidar;
};

/// Returns the lidar presets of groundray, by name. @throws Error as load_lidar.
std::vector<SensorPreset> lidar_presets();

/// Returns a DEM as a scene of bare Lambertian ground, which reflects `bare_reflectance` of the
/// light at any wavelength; there is no sun. For scanning only: the scene has no sensors. A DEM in
/// geographic coordinates is warped to its UTM zone.
/// @param stop  requests a stop of the certification that a large DEM requires.
/// @throws Error as Terrain.
/// @throws Interrupted if a stop is requested.
Simulation simulation_of_dem(const std::filesystem::path& dem, const std::stop_token& stop = {});
inline constexpr double bare_reflectance = 0.3;

/// Placement of a sensor on the ground.
struct SensorPlace {
  glm::dvec2 at_m{0};               ///< position in D
  double height_m = 1.8;            ///< height of its origin above the ground vertically below
  double heading_rad = 0;           ///< azimuth of its x axis, from east towards north
  Stance stance = Stance::Upright;  ///< or tilted with the ground
};

/// Returns X_DS of a placed sensor.
/// @throws Error if there is no ground at the position, or the height is not positive.
Pose pose_at(const SensorPlace& place, const Ground& ground);

/// Result of a scan from one pose.
struct PlacedScan {
  LidarScan scan;                     ///< columns as in docs/reference/formats.md
  std::chrono::nanoseconds stamp{0};  ///< stamp of the sweep
  std::vector<std::string> notes;     ///< messages for the user: omissions and assumptions
};

/// Progress callback: receives the completed fraction, 0 to 1, and the name of the current step.
using ScanProgress = std::function<void(double share, const std::string& step)>;

/// Scans a scene from any pose. Structures built for one pose are reused for nearby ones. Only one
/// thread at a time may call scan().
class SceneScanner {
 public:
  /// @param simulation  must outlive this.
  explicit SceneScanner(const Simulation& simulation)
      : simulation_(simulation), scene_(simulation) {}

  /// Simulates the first sweep of a lidar at a constant pose. The result equals that of `groundray
  /// generate` for a scene whose first sensor is this lidar at this pose, with the scene's seed. If
  /// the scene's surfaces have no materials, only rays are traced, without light, and a note
  /// reports it.
  /// @param stop      requests a stop, from any thread: the sweep stops within milliseconds, but
  ///                  the construction of the scene before it is completed first.
  /// @param progress  called by one thread at a time, not necessarily the calling one; may be
  ///                  empty.
  /// @throws Interrupted if a stop is requested.
  /// @throws Error as Lidar, Lidar::scan and FrameSceneBuilder.
  PlacedScan scan(LidarSpec spec, const Pose& X_DS, const std::stop_token& stop = {},
                  const ScanProgress& progress = {});

 private:
  const Simulation& simulation_;
  FrameSceneBuilder scene_;
};

}  // namespace groundray
