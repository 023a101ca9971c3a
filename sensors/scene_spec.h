#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
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
#include "terrain/dem_io.h"
#include "terrain/terrain.h"

namespace groundray {

/// The ground of a scene.
struct TerrainSpec {
  std::filesystem::path dem;  ///< absolute, or relative to the working directory
  DemOptions options;
  std::uint16_t label = 1;           ///< semantic class of the ground
  std::optional<Material> material;  ///< there must be one if a lidar has light
  TerrainDetail detail;
};

/// A platform that follows a recorded path: body B in W, TUM form.
struct RecordedPath {
  std::filesystem::path tum;
};

/// A platform that drives over the ground (see GroundPathSpec); waypoints in W, the CRS of the DEM.
struct DrivenPath {
  std::vector<glm::dvec2> waypoints_m;
  double speed_m_s = 1;
  double height_m = 0;
  glm::dvec2 footprint_m{2, 1.5};
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
};

}  // namespace groundray
