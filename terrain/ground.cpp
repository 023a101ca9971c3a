#include "terrain/ground.h"

#include <cstddef>
#include <utility>

namespace groundray {

Ground::Ground(const HeightGrid& grid)
    : frame_(grid.frame()), cell_([grid](int column, int row) { return grid.cell(column, row); }) {}

Ground::Ground(std::shared_ptr<const TileSource> source, const GridFrame& frame)
    : frame_(frame), cell_([source = std::move(source)](int column, int row) {
        const glm::ivec2 which(column / Tile::cells, row / Tile::cells);
        const std::shared_ptr<const Tile> tile = source->tile({0, which});
        const int x = column - which.x * Tile::cells;
        const int y = row - which.y * Tile::cells;
        const auto height_m = [&](int right, int down) -> double {
          const int index = (y + down) * Tile::points + x + right;
          return tile->heights_m[static_cast<std::size_t>(index)];
        };
        return Cell{column,         row,           1, 1, height_m(0, 0), height_m(1, 0),
                    height_m(0, 1), height_m(1, 1)};
      }) {}

std::optional<double> Ground::height_m_at(glm::dvec2 p) const {
  return surface_height_m(frame_, p, cell_);
}

}  // namespace groundray
