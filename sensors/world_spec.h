#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/ground_cover.h"
#include "core/material.h"
#include "core/model_io.h"
#include "terrain/asset.h"
#include "terrain/density_map.h"
#include "terrain/scatter.h"

namespace groundray {

/// A platform or object that follows a recorded path: body B in W, TUM form.
struct RecordedPath {
  std::filesystem::path tum;
};

/// One that drives over the ground (see GroundPathSpec); waypoints in W, the CRS of the DEM.
struct DrivenPath {
  std::vector<glm::dvec2> waypoints_m;
  double speed_m_s = 1;
  double height_m = 0;
  glm::dvec2 footprint_m{2, 1.5};
};

/// An image that displaces a model's surface; see Displacement.
struct DisplacementSource {
  std::filesystem::path image;
  double amplitude_m = 0;
  double middle = 0.5;
  double cell_m = 0;
};

/// A model in a file.
struct ModelSource {
  std::filesystem::path file;
  ModelOptions options;
  std::optional<DisplacementSource> displacement;
};

/// A model and what it is made of.
struct ModelSpec {
  std::variant<AssetSpec, ModelSource> source;
  std::map<std::string, Material> materials;  ///< by the name of a surface
  std::optional<Material> material;           ///< of all other surfaces
};

/// An object that stands: where its origin is in W.
struct StandingObject {
  glm::dvec2 at_m{0};
  std::optional<double> height_m;  ///< else on the ground
  double yaw_deg = 0, pitch_deg = 0, roll_deg = 0;
  Stance stance = Stance::Upright;
};

/// Images that repeat over the ground.
struct GroundTextureSpec {
  std::filesystem::path albedo, normal;  ///< empty for none
  double size_m = 1;                     ///< of one copy
};

/// A layer of the ground's cover.
struct CoverSpec {
  std::optional<Material> material;    ///< there must be one if a lidar has light
  std::optional<std::uint16_t> label;  ///< else the terrain's
  CoverLimits slope_rad{};
  CoverLimits height_m{};      ///< in W
  std::filesystem::path mask;  ///< empty for none
  double mask_full = 1;        ///< the value of the mask that means all
  std::optional<double> mask_nodata;
  std::optional<GroundTextureSpec> texture;
};

/// One object.
struct ObjectSpec {
  std::string name;
  std::uint16_t label = 0;
  ModelSpec model;
  double scale = 1;
  std::variant<StandingObject, RecordedPath, DrivenPath> place;
};

/// A layer of many objects.
struct ScatterLayer {
  std::string name;
  std::uint16_t label = 0;
  std::vector<ModelSpec> models;      ///< as many as the scatter has weights
  double density_per_m2 = 0;          ///< with a map, for each unit of its values
  std::filesystem::path density_map;  ///< empty for the same density everywhere
  std::optional<double> nodata;       ///< of the map
  ScatterSpec scatter;                ///< clearings in W; its layer is a hash of the name
};

}  // namespace groundray
