#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <utility>

#include "core/tracing/leaf.h"
#include "core/tracing/level_scene.h"

namespace groundray {

/// Returns the position of a point of the level in L.
inline glm::dvec3 point_L(const LevelScene::Impl& level, int column, int row,
                          double height_m) noexcept {
  return glm::dvec3(level.level.frame.to_D({column, row}), height_m) - level.p_DL;
}

/// Cells of a leaf, 2^exponent cells of the DEM wide: their number and the positions of their
/// points.
struct LeafCells {
  const LevelScene::Impl& level;
  const Leaf& leaf;
  int exponent = std::countr_zero(static_cast<unsigned>(leaf.step));
  int columns = count(leaf.column, level.last.x);
  int rows = count(leaf.row, level.last.y);
  /// Thinned sides are respected only if the cells are the leaf's own.
  ThinnedBlock block{{columns, rows},
                     (1 << exponent) == leaf.step ? leaf.coarser : std::uint8_t{0}};

  int count(int first, int last) const {
    const int end = std::min(first + level.level.leaf_cells * leaf.step, last);
    return (end - first + (1 << exponent) - 1) >> exponent;
  }
  int column(int i) const { return std::min(leaf.column + (i << exponent), level.last.x); }
  int row(int j) const { return std::min(leaf.row + (j << exponent), level.last.y); }
  /// Returns the height of a sample.
  float height_m(glm::ivec2 point) const { return level.height_m(column(point.x), row(point.y)); }

  /// Returns true if a point is omitted because the neighbour is coarser.
  bool drops(glm::ivec2 p) const { return block.drops(p.x, p.y); }

  /// Returns true if an omitted point lies on the leaf's first or last row.
  bool drops_in_row(glm::ivec2 p) const { return p.x % 2 == 1 && (p.y == 0 || p.y == rows); }

  /// Returns the height of the surface at a point: that of the sample or, if it is omitted, of the
  /// line between its neighbours along the boundary.
  double surface_m(glm::ivec2 p) const {
    if (!drops(p)) return height_m(p);
    const bool in_row = drops_in_row(p);
    const glm::ivec2 step(in_row ? 1 : 0, in_row ? 0 : 1), a = p - step, b = p + step;
    const int before = in_row ? column(a.x) : row(a.y), after = in_row ? column(b.x) : row(b.y);
    const int at = in_row ? column(p.x) : row(p.y);
    const double a_m = height_m(a);
    return a_m + (height_m(b) - a_m) * (static_cast<double>(at - before) / (after - before));
  }

  /// Returns the cells [low, high) that are neither narrower nor adjacent to a thinned side; none
  /// if the leaf has holes.
  std::pair<glm::ivec2, glm::ivec2> ordinary() const {
    if (leaf.has_holes) return {glm::ivec2(0), glm::ivec2(0)};
    const bool narrow_x = column(columns) - column(columns - 1) < leaf.step;
    const bool narrow_y = row(rows) - row(rows - 1) < leaf.step;
    return {{block.thins(Leaf::West) ? 1 : 0, block.thins(Leaf::North) ? 1 : 0},
            {columns - (block.thins(Leaf::East) || narrow_x ? 1 : 0),
             rows - (block.thins(Leaf::South) || narrow_y ? 1 : 0)}};
  }
};

}  // namespace groundray
