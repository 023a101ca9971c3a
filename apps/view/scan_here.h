#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/scene/frame_scene.h"
#include "apps/scene/world.h"
#include "core/pose.h"
#include "sensors/lidar.h"
#include "sensors/lidar_spec.h"
#include "terrain/scatter.h"

namespace groundray {

/// A lidar that can be put anywhere.
struct SensorPreset {
  std::string name;   ///< "velodyne_vlp16"
  std::string model;  ///< for people: "Velodyne VLP-16"
  LidarSpec lidar;
};

/// Returns the lidars that groundray comes with, by name. @throws Error as load_lidar.
std::vector<SensorPreset> lidar_presets();

/// Returns a DEM as a scene in which nothing else is: bare ground, the same to all sides, that
/// reflects `bare_reflectance` of the light of any wavelength; there is no sun. Only for scanning:
/// it has no sensors of its own. A DEM that is placed by angles is warped to its UTM zone.
/// @param stop  asks for an end of the certification that a large DEM needs.
/// @throws Error as Terrain. @throws Interrupted if it was asked to stop.
World world_of_dem(const std::filesystem::path& dem, const std::stop_token& stop = {});
inline constexpr double bare_reflectance = 0.3;

/// Where a sensor is put down.
struct SensorPlace {
  glm::dvec2 at_m{0};               ///< in D
  double height_m = 1.8;            ///< of its origin above the ground right below it
  double heading_rad = 0;           ///< of its x axis, from east to north
  Stance stance = Stance::Upright;  ///< or as the ground leans there
};

/// Returns X_DS of a sensor that is put down.
/// @throws Error if there is no ground there, or the height is not positive.
Pose pose_at(const SensorPlace& place, const Ground& ground);

/// What a scan at a place is, besides where.
struct ScanRequest {
  LidarSpec lidar;
  Pose X_DS;                         ///< it stands still
  std::chrono::nanoseconds time{0};  ///< of the run: the sweep that is under way then is made
};

/// What came of it.
struct PlacedScan {
  LidarScan scan;                     ///< columns as docs/formats.md has them
  std::chrono::nanoseconds stamp{0};  ///< of its sweep
  std::vector<std::string> notes;     ///< for people: what was left out or assumed
};

/// What the one that waits is told: the share that is done, 0 to 1, and of what.
using ScanProgress = std::function<void(double share, const std::string& step)>;

/// Scans a scene from anywhere. What it builds of the scene for one place is used again for the
/// next one near it. One thread at a time may scan.
class SceneScanner {
 public:
  /// @param world  is to outlive this.
  explicit SceneScanner(const World& world) : world_(world), scene_(world) {}

  /// Makes one sweep of a lidar, the same that `groundray generate` writes of a scene in which that
  /// sensor is the first and stands there, with the scene's seed. A scene whose surfaces have no
  /// materials has no light: then rays alone are traced, and a note says so.
  /// @param stop      asks for an end, from any thread: the sweep ends within milliseconds; the
  ///                  building of the scene before it is waited for.
  /// @param progress  called by one thread at a time, but not always by this one; may be none.
  /// @throws Interrupted if it was asked to stop. @throws Error as Lidar, Lidar::scan and
  ///         FrameScene.
  PlacedScan scan(const ScanRequest& request, const std::stop_token& stop = {},
                  const ScanProgress& progress = {});

 private:
  const World& world_;
  FrameScene scene_;
};

/// Scans once, as SceneScanner.
PlacedScan scan_here(const World& world, const ScanRequest& request,
                     const std::stop_token& stop = {}, const ScanProgress& progress = {});

}  // namespace groundray
