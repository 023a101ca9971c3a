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
  std::vector<ObjectSpec> objects;
  std::vector<ScatterLayer> scatter;
  std::optional<SkySpec> sky;
};

}  // namespace groundray
