#include "terrain/terrain_scene.h"

#include <algorithm>
#include <cmath>

namespace groundray {
namespace {

constexpr int tile_cells = 64;
// Side of the parts of a tile with holes: a triangle takes ten times its memory in a grid.
constexpr int part_cells = 8;

// Calls `act` for every block of up to `cells` x `cells` cells that `whole` is made of.
template <typename Act>
void for_each_tile(const Level::Block& whole, int cells, const Act& act) {
  for (int row = 0; row < whole.rows - 1; row += cells) {
    for (int column = 0; column < whole.columns - 1; column += cells) {
      act(Level::Block{whole.column + column, whole.row + row,
                       std::min(cells, whole.columns - 1 - column) + 1,
                       std::min(cells, whole.rows - 1 - row) + 1});
    }
  }
}

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
  const Level::Block all{0, 0, grid.columns(), grid.rows()};
  for_each_tile(all, tile_cells, [&](const Level::Block& tile) {
    if (whole || !has_hole(grid, tile)) {
      level.blocks.push_back(tile);
      return;
    }
    for_each_tile(tile, part_cells, [&](const Level::Block& part) {
      if (has_hole(grid, part)) {
        append_facets(grid, part, level.facets);
      } else {
        level.blocks.push_back(part);
      }
    });
  });
  return level;
}

}  // namespace groundray
