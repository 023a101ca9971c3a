#pragma once

// Private to the library: the ground of all cells of a tile.
#include <cstdint>
#include <glm/vec2.hpp>
#include <limits>
#include <span>
#include <vector>

#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/fusion/cell_surfaces.h"
#include "reconstruction/dem/fusion/packed_point.h"

namespace groundray {

/// Parameters for fitting a tile; see FusionOptions.
struct TileRules {
  glm::dvec2 step_m{1};
  double gap_m = 0;
  double steepest_slope = 0;
  double slope_sd = 0;
  double most_sd_m = std::numeric_limits<double>::infinity();
  OutlierRule outliers;
};

/// Numbers of cells that have points but stay unmeasured.
struct TileCounts {
  std::uint64_t without_ground = 0;
  std::uint64_t uncertain = 0;  ///< cells whose ground has a larger sd than most_sd_m
};

/// Points in several pieces of memory.
using PointParts = std::vector<std::span<const PackedPoint>>;

/// Fits each cell of a tile to its points and writes it to its position in `layers`.
/// @param parts  points of the tile and its margin, in any order, which does not affect the result.
/// @param size  columns and rows of the tile without its margin.
/// @param first  first cell of the tile in `layers`.
TileCounts fit_tile(const PointParts& parts, glm::ivec2 size, glm::ivec2 first,
                    const TileRules& rules, DemLayers& layers);

}  // namespace groundray
