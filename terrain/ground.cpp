#include "terrain/ground.h"

#include <utility>

#include "core/geometry/surface_height.h"

namespace groundray {

Ground::Ground(const HeightGrid& grid)
    : frame_(grid.frame()), cell_([grid](int column, int row) { return grid.cell(column, row); }) {}

Ground::Ground(std::shared_ptr<const TileSource> source, const GridFrame& frame)
    : frame_(frame), cell_([source = std::move(source)](int column, int row) {
        const glm::ivec2 cell(column, row);
        return cell_of(*source->tile({0, cell / Tile::cells}), cell);
      }) {}

Ground::Ground(const Ground& dem, std::shared_ptr<const Relief> relief)
    : frame_(relief->frame()),
      cell_([dem_cell = dem.cell_, relief = std::move(relief)](int column, int row) {
        const Cell cell = dem_cell(column >> relief->exponent(), row >> relief->exponent());
        const auto height_m = [&](int right, int down) -> double {
          return relief->height_m(cell, {column + right, row + down});
        };
        return Cell{column,         row,           1, 1, height_m(0, 0), height_m(1, 0),
                    height_m(0, 1), height_m(1, 1)};
      }) {}

std::optional<double> Ground::height_m_at(glm::dvec2 p) const {
  return surface_height_m(frame_, p, cell_);
}

std::optional<FacetPlane> Ground::facet_at(glm::dvec2 p) const {
  Cell cell;
  const auto keep = [&](int column, int row) { return cell = cell_(column, row); };
  if (!surface_height_m(frame_, p, keep)) return std::nullopt;
  const glm::dvec2 at = frame_.to_grid(p);
  return cell.plane(cell.half_at(at.x, at.y));
}

}  // namespace groundray
