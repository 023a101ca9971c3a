#pragma once

#include <algorithm>
#include <bit>
#include <utility>

#include "core/tracing/level_scene.h"

namespace groundray {

/// Returns the position of a point of the level in L.
inline glm::dvec3 point_L(const LevelScene::Impl& level, int column, int row,
                          double height_m) noexcept {
  return glm::dvec3(level.level.frame.to_D({column, row}), height_m) - level.p_DL;
}

/// Cells of a leaf: their number and the positions of their points.
struct LeafCells {
  const LevelScene::Impl& level;
  const Leaf& leaf;
  int exponent = std::countr_zero(static_cast<unsigned>(leaf.step));
  int columns = count(leaf.column, level.last.x);
  int rows = count(leaf.row, level.last.y);

  int count(int first, int last) const {
    return std::min(level.level.leaf_cells, (last - first + leaf.step - 1) >> exponent);
  }
  int column(int i) const { return std::min(leaf.column + (i << exponent), level.last.x); }
  int row(int j) const { return std::min(leaf.row + (j << exponent), level.last.y); }
  float height_m(glm::ivec2 point) const { return level.height_m(column(point.x), row(point.y)); }
  bool thins(Leaf::Side side) const { return (leaf.coarser & side) != 0; }
  /// Returns true if a point is omitted because the neighbour is coarser.
  bool drops(glm::ivec2 p) const {
    const glm::ivec2 dem_last = level.level.frame.samples - 1;
    return (p.x % 2 == 1 && column(p.x) < dem_last.x &&
            ((p.y == 0 && thins(Leaf::North)) || (p.y == rows && thins(Leaf::South)))) ||
           (p.y % 2 == 1 && row(p.y) < dem_last.y &&
            ((p.x == 0 && thins(Leaf::West)) || (p.x == columns && thins(Leaf::East))));
  }
  /// Returns the cells [low, high) that are neither narrower nor adjacent to a thinned side; none
  /// if the leaf has holes.
  std::pair<glm::ivec2, glm::ivec2> ordinary() const {
    if (leaf.has_holes) return {glm::ivec2(0), glm::ivec2(0)};
    const bool narrow_x = column(columns) - column(columns - 1) < leaf.step;
    const bool narrow_y = row(rows) - row(rows - 1) < leaf.step;
    return {{thins(Leaf::West) ? 1 : 0, thins(Leaf::North) ? 1 : 0},
            {columns - (thins(Leaf::East) || narrow_x ? 1 : 0),
             rows - (thins(Leaf::South) || narrow_y ? 1 : 0)}};
  }
};

}  // namespace groundray
