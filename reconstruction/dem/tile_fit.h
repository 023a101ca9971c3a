#pragma once

// Private to the library: the ground of all cells of a tile.
#include <cstdint>
#include <glm/vec2.hpp>
#include <limits>
#include <span>
#include <vector>

#include "reconstruction/dem/cell_surfaces.h"
#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/packed_point.h"

namespace groundray {

/// What is to be made of a tile's points.
struct TileRules {
  glm::dvec2 step_m{1};
  double gap_m = 0;
  double steepest_slope = 0;
  double slope_sd = 0;
  double most_sd_m = std::numeric_limits<double>::infinity();
  OutlierRule outliers;
};

/// Cells that have points, but stay unmeasured.
struct TileCounts {
  std::uint64_t without_ground = 0;
  std::uint64_t uncertain = 0;  ///< their ground's sd is above the most
};

/// Points that do not lie in one piece.
using PointParts = std::vector<std::span<const PackedPoint>>;

/// Fits each cell of a tile to its points and writes it to its place in `layers`.
/// @param parts   of the tile's points and its rim's, in any order, which changes nothing.
/// @param size    of the tile without its rim, in cells.
/// @param first   the tile's first cell, in `layers`.
TileCounts fit_tile(const PointParts& parts, glm::ivec2 size, glm::ivec2 first,
                    const TileRules& rules, DemLayers& layers);

}  // namespace groundray
