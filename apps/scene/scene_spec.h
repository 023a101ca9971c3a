#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/scene/world_spec.h"
#include "core/appearance/material.h"
#include "core/geometry/pose.h"
#include "core/random.h"
#include "core/tracing/ray_tracer.h"
#include "sensors/camera/camera_spec.h"
#include "sensors/lidar/lidar_spec.h"
#include "sensors/sky/atmosphere.h"
#include "sensors/sky/sky.h"
#include "terrain/dem/dem_io.h"
#include "terrain/relief/relief.h"
#include "terrain/terrain.h"

namespace groundray {

/// Ground of a scene.
struct TerrainSpec {
  std::filesystem::path dem;  ///< absolute, or relative to the working directory
  DemOptions options;
  std::uint16_t label = 1;           ///< semantic class of the ground
  std::optional<Material> material;  ///< required if there is a camera or a lidar with light
  TerrainDetail detail;
  std::optional<ReliefSpec> relief;
  std::optional<GroundTextureSpec> texture;  ///< texture of `material`
  std::vector<CoverSpec> cover;      ///< layers over `material`, from the lowest to the uppermost
  std::filesystem::path orthophoto;  ///< empty for none
};

/// Lidar and its mount.
struct MountedLidar {
  std::string name;    ///< name of its files; letters, digits, '_' and '-'
  std::string source;  ///< preset or file, as the scene names it
  std::string text;    ///< content of the file
  LidarSpec lidar;
  Pose X_BS;
};

/// Camera and its mount.
struct MountedCamera {
  /// Trigger by a lidar: one image for each of its sweeps.
  struct Trigger {
    std::string lidar;
    double delay_s = 0;  ///< time from the sweep's stamp to the start of the image
  };

  std::string name;    ///< as MountedLidar::name; unique among all sensors
  std::string source;  ///< as MountedLidar::source
  std::string text;    ///< content of the file
  CameraSpec camera;
  Pose X_BC;
  std::optional<Trigger> trigger;   ///< replaces the camera's own rate and first image
  std::vector<std::string> lidars;  ///< lidars whose echoes are projected into its images
};

/// Stereo pair.
struct StereoSpec {
  enum class Images {
    AsMounted,
    Rectified,  ///< rendered as pinholes of one orientation, across their baseline
  };
  std::string name;
  std::string left, right;  ///< names of cameras
  Images images = Images::AsMounted;
};

/// Content of a scene file.
struct SceneSpec {
  std::string text;  ///< text of the file
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
