#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/appearance/ground_cover.h"
#include "core/appearance/material.h"
#include "core/appearance/tiling.h"
#include "terrain/dem/dem_io.h"
#include "terrain/erosion/erosion.h"
#include "terrain/relief/relief.h"
#include "terrain/terrain.h"
#include "terrain/textures/ground_images.h"

namespace groundray {

/// Images that continue over the ground, of files or generated.
struct GroundTextureSpec {
  std::filesystem::path albedo, normal;      ///< empty for none
  std::optional<GroundImageSpec> generated;  ///< replaces both
  double size_m = 1;                         ///< size of one copy
  /// By default files repeat, and generated images are stochastic unless the relief is made of
  /// them.
  std::optional<Tiling> tiling;
  bool seamless = false;  ///< the files must repeat without seams
};

/// Conditions on a place, besides slope and height, under which ground has a cover and plants grow.
struct SiteConditions {
  /// Distance from trails.
  struct BesideTrail {
    enum class From : std::uint8_t {
      Edge,  ///< of the carriageway; negative on it
      Ruts,  ///< the middle of the nearest rut
    };
    std::string name;  ///< empty for the nearest of all trails
    From from = From::Edge;
    CoverLimits limits_m{};
  };
  std::optional<BesideTrail> trail;
  /// Water after rain.
  struct Water {
    enum class Quantity : std::uint8_t {
      Depth,     ///< of standing water, metres
      Wetness,   ///< topographic wetness index
      Distance,  ///< from standing water, metres
    };
    Quantity quantity = Quantity::Depth;
    CoverLimits limits{};
  };
  std::optional<Water> water;
  std::optional<CoverLimits> canopy;  ///< share of the neighbourhood under crowns
};

/// Layer of the ground's cover.
struct CoverSpec {
  std::optional<Material> material;    ///< required if there is a camera or a lidar with light
  std::optional<std::uint16_t> label;  ///< the terrain's by default
  CoverLimits slope_rad{};
  CoverLimits height_m{};      ///< heights in W
  std::filesystem::path mask;  ///< empty for none
  double mask_full = 1;        ///< value of the mask that means full cover
  std::optional<double> mask_nodata;
  SiteConditions site;
  std::optional<GroundTextureSpec> texture;
};

/// Grid on which water is computed.
struct WaterGrid {
  double cell_m = 0.5;
  double most_m = 0.3;  ///< depth of depressions above which water seeps away
};

/// Grid on which the canopy is computed.
struct CanopyGrid {
  double cell_m = 0.5;
  double radius_m = 3;  ///< of the neighbourhood of a place
};

/// Ground of a scene.
struct TerrainSpec {
  std::filesystem::path dem;  ///< absolute, or relative to the working directory
  DemOptions options;
  std::uint16_t label = 1;           ///< semantic class of the ground
  std::optional<Material> material;  ///< required if there is a camera or a lidar with light
  TerrainDetail detail;
  std::optional<ErosionSpec> erosion;
  std::optional<ReliefSpec> relief;
  std::optional<GroundImageSpec> relief_ground;  ///< whose heights are the relief's image
  std::optional<WaterGrid> water;                ///< required if a layer depends on water
  CanopyGrid canopy;
  std::optional<GroundTextureSpec> texture;  ///< texture of `material`
  std::vector<CoverSpec> cover;      ///< layers over `material`, from the lowest to the uppermost
  std::filesystem::path orthophoto;  ///< empty for none
  std::string where;                 ///< of the DEM's name
};

}  // namespace groundray
