#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/material.h"
#include "core/pose.h"
#include "core/random.h"
#include "core/ray_tracer.h"
#include "sensors/atmosphere.h"
#include "sensors/camera/camera_spec.h"
#include "sensors/lidar_spec.h"
#include "sensors/sky.h"
#include "sensors/world_spec.h"
#include "terrain/dem_io.h"
#include "terrain/relief.h"
#include "terrain/terrain.h"

namespace groundray {

/// The ground of a scene.
struct TerrainSpec {
  std::filesystem::path dem;  ///< absolute, or relative to the working directory
  DemOptions options;
  std::uint16_t label = 1;           ///< semantic class of the ground
  std::optional<Material> material;  ///< there must be one if a lidar has light
  TerrainDetail detail;
  std::optional<ReliefSpec> relief;
  std::optional<GroundTextureSpec> texture;  ///< of that material
  std::vector<CoverSpec> cover;              ///< over it, from the lowest to the uppermost
  std::filesystem::path orthophoto;          ///< empty for none
};

/// A lidar and where it sits.
struct MountedLidar {
  std::string name;    ///< names its files; letters, digits, '_' and '-'
  std::string source;  ///< the preset or file that it came from, as the scene says it
  std::string text;    ///< of that file
  LidarSpec lidar;
  Pose X_BS;
};

/// A camera and where it sits.
struct MountedCamera {
  /// Images that a lidar triggers: one for each of its sweeps.
  struct Trigger {
    std::string lidar;
    double delay_s = 0;  ///< from the sweep's stamp to the begin of the image
  };

  std::string name;    ///< as MountedLidar's, and different from all of theirs
  std::string source;  ///< likewise
  std::string text;    ///< of that file
  CameraSpec camera;
  Pose X_BC;
  std::optional<Trigger> trigger;   ///< instead of the camera's own rate and first image
  std::vector<std::string> lidars;  ///< whose echoes are shown in its images
};

/// Two cameras side by side.
struct StereoSpec {
  enum class Images {
    AsMounted,
    Rectified,  ///< as pinholes that look the same way, across their baseline
  };
  std::string name;
  std::string left, right;  ///< names of cameras
  Images images = Images::AsMounted;
};

/// A scene file, understood.
struct SceneSpec {
  std::string text;  ///< the file as read
  Seed seed;
  Tracing tracing = Tracing::Fast;
  double duration_s = 0;
  TerrainSpec terrain;
  AtmosphereSpec air;
  std::variant<RecordedPath, DrivenPath> platform;
  std::vector<MountedLidar> lidars;
  std::vector<MountedCamera> cameras;
  std::vector<StereoSpec> stereo;
  std::vector<ObjectSpec> objects;
  std::vector<ScatterLayer> scatter;
  std::optional<SkySpec> sky;
};

}  // namespace groundray
