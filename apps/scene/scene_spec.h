#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/scene/ground_spec.h"
#include "core/appearance/material.h"
#include "core/geometry/pose.h"
#include "core/model/model_io.h"
#include "core/random.h"
#include "core/tracing/ray.h"
#include "core/tracing/sway.h"
#include "sensors/camera/camera_spec.h"
#include "sensors/lidar/lidar_spec.h"
#include "sensors/sky/atmosphere.h"
#include "sensors/sky/sky.h"
#include "terrain/assets/asset.h"
#include "terrain/scatter/scatter.h"

namespace groundray {

// Members named `where` are places in the scene file, path:line:column, for messages.

/// Recorded path of a platform or object: poses of body B in W, in TUM format.
struct RecordedPath {
  std::filesystem::path tum;
  std::string where;
  std::string text;  ///< content, if it is in memory: then there is no file
};

/// Path driven over the ground (see GroundPathSpec); waypoints in W, the CRS of the DEM.
struct DrivenPath {
  std::vector<glm::dvec2> waypoints_m;  ///< none if it follows a trail
  std::string trail;                    ///< name of a trail, or empty
  double speed_m_s = 1;
  double height_m = 0;
  glm::dvec2 footprint_m{2, 1.5};
  double from_m = 0;  ///< arc length at which it starts
  std::string where;  ///< of the waypoints, or of the trail's name
};

/// Image that displaces a model's surface; see Displacement.
struct DisplacementSource {
  std::filesystem::path image;
  double amplitude_m = 0;
  double middle = 0.5;
  double cell_m = 0;
};

/// Model in a file.
struct ModelSource {
  std::filesystem::path file;
  ModelOptions options;
  std::optional<DisplacementSource> displacement;
};

/// Model in memory.
struct GivenModel {
  std::shared_ptr<const Model> model;
};

/// Rigid part of an asset that walks.
struct AssetPart {
  AssetSpec asset;
  std::size_t part = 0;
};

/// Model and its materials.
struct ModelSpec {
  using Source = std::variant<AssetSpec, ModelSource, GivenModel, AssetPart>;
  Source source;
  std::map<std::string, Material> materials;  ///< materials by surface name
  std::optional<Material> material;           ///< material of all other surfaces
  std::optional<Flexibility> sway;            ///< that of the kind for assets, else none
};

/// Static object: position of its origin in W, and its orientation; or a fence along a line.
struct StandingObject {
  glm::dvec2 at_m{0};
  std::optional<double> height_m;  ///< height in W; on the ground by default
  double yaw_deg = 0, pitch_deg = 0, roll_deg = 0;
  Stance stance = Stance::Upright;
  std::vector<glm::dvec2> line_m{};  ///< of a fence, in W, instead of the above; else empty
};

/// Object of a scene.
struct ObjectSpec {
  std::string name;
  std::uint16_t label = 0;
  ModelSpec model;
  double scale = 1;
  std::variant<StandingObject, RecordedPath, DrivenPath> place;
  std::string where;
};

/// Ground that is kept free along a trail.
struct ClearedTrail {
  std::string name;
  double half_width_m = 0;
};

/// Species of an ecosystem, whose plants compete for room.
struct SpeciesSpec {
  double zone = 1;       ///< radius of a plant's zone of influence, as a multiple of its crown's
  double tolerance = 0;  ///< of shade; see Contender
  double min_distance_m = 0;
};

/// Layer of scattered objects.
struct ScatterLayer {
  std::string name;
  std::uint16_t label = 0;
  std::vector<ModelSpec> models;  ///< one for each of the weights of `scatter`
  double density_per_m2 = 0;  ///< per horizontal square metre; with a map, per unit of its values
  std::filesystem::path density_map;  ///< empty for the same density everywhere
  std::optional<double> nodata;       ///< nodata value of the map
  Area area_W;                        ///< nothing grows outside
  ScatterSpec scatter;                ///< clearings in W; its `layer` is a hash of the name
  std::vector<ClearedTrail> trails;   ///< further clearings
  SiteConditions site;
  std::optional<SpeciesSpec> species;  ///< if set, the scale of `scatter` is the height in metres
  std::string where;
};

/// Lidar and its mount.
struct MountedLidar {
  std::string name;    ///< name of its files; letters, digits, '_' and '-'
  std::string source;  ///< preset or file, as the scene names it
  std::string text;    ///< content of the file
  LidarSpec lidar;
  Pose X_BS;
  std::string where;
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
  std::string where;
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
  std::string where;
};

/// World of a scene file whose values were drawn (docs/reference/sampling.md).
struct DrawnWorld {
  std::uint32_t number = 0;
  std::string drawn;  ///< keys and values: a map of YAML in one line
};

/// Content of a scene file.
struct SceneSpec {
  std::string text;  ///< text of the file, or of a world of it
  std::optional<DrawnWorld> world;
  std::map<std::uint16_t, std::string> classes;  ///< by label (docs/reference/labels.md)
  std::uint32_t worlds = 0;  ///< number of worlds of the file, if none of them is chosen
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
  Wind wind;  ///< without origin and variant, which follow from the terrain and the seed
};

}  // namespace groundray
