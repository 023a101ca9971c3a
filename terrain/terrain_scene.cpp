#include "terrain/terrain_scene.h"

#include <algorithm>
#include <cmath>

namespace groundray {
namespace {

constexpr int tile_cells = 64;

bool has_hole(const HeightGrid& grid, const Level::Block& block) {
  for (int row = block.row; row < block.row + block.rows; ++row) {
    for (int column = block.column; column < block.column + block.columns; ++column) {
      if (std::isnan(grid.height_m(column, row))) return true;
    }
  }
  return false;
}

void append_facets(const HeightGrid& grid, const Level::Block& block, std::vector<Facet>& facets) {
  for (int row = block.row; row < block.row + block.rows - 1; ++row) {
    for (int column = block.column; column < block.column + block.columns - 1; ++column) {
      for (const Facet::Half half : {Facet::Half::Near, Facet::Half::Far}) {
        const Facet facet{column, row, half};
        if (!std::isnan(grid.plane(facet).height_m)) facets.push_back(facet);
      }
    }
  }
}

}  // namespace

Level full_resolution_level(const HeightGrid& grid) {
  Level level{grid, {}, {}};
  const bool whole = grid.hole_count() == 0;
  for (int row = 0; row < grid.rows() - 1; row += tile_cells) {
    for (int column = 0; column < grid.columns() - 1; column += tile_cells) {
      const Level::Block block{column, row, std::min(tile_cells, grid.columns() - 1 - column) + 1,
                               std::min(tile_cells, grid.rows() - 1 - row) + 1};
      if (whole || !has_hole(grid, block)) {
        level.blocks.push_back(block);
      } else {
        append_facets(grid, block, level.facets);
      }
    }
  }
  return level;
}

}  // namespace groundray
