#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>

#include "core/geometry/cell.h"
#include "core/tracing/leaf.h"

namespace groundray {

/// Data of a level for queries in double precision, as pointers, so that devices can use it.
struct LevelView {
  glm::ivec2 first{0};  ///< the DEM's sample at the window's first point
  glm::ivec2 last{0};   ///< the DEM's sample at the window's last point
  glm::ivec2 points{0};
  const float* heights_m = nullptr;  ///< of the points, row by row
  int step_exponent = 0;             ///< the finest cells are 2^this cells of the DEM wide
  int leaf_cells = 8;
  int block_exponent = 0;  ///< a block is the finest leaf, 2^this cells of the DEM wide
  glm::ivec2 blocks{0};
  const Leaf* leaves = nullptr;
  const std::int32_t* leaf_of_block = nullptr;  ///< index of its leaf; -1 outside the leaves

  /// Returns whether a cell of the DEM lies in the window.
  bool contains(int column, int row) const noexcept {
    return first.x <= column && column < last.x && first.y <= row && row < last.y;
  }
  float point_m(int column, int row) const noexcept {
    return heights_m[static_cast<std::ptrdiff_t>(row) * points.x + column];
  }
  /// Returns the height of a sample of the DEM that is a point of the level.
  float height_m(int column, int row) const noexcept {
    return point_m(column == last.x ? points.x - 1 : (column - first.x) >> step_exponent,
                   row == last.y ? points.y - 1 : (row - first.y) >> step_exponent);
  }
  const Leaf* leaf_of(glm::ivec2 block) const noexcept {
    const std::int32_t leaf =
        leaf_of_block[static_cast<std::ptrdiff_t>(block.y) * blocks.x + block.x];
    return leaf < 0 ? nullptr : leaves + leaf;
  }
  /// Returns the leaf that contains a cell of the DEM, or nullptr.
  const Leaf* leaf_at(int column, int row) const noexcept {
    return leaf_of({(column - first.x) >> block_exponent, (row - first.y) >> block_exponent});
  }
  /// Returns the exponent of the cells that are used in double precision in a leaf. If the leaf has
  /// no deviation, this is the level's own, so that ranges equal those at full resolution to the
  /// last bit.
  int deciding_exponent(const Leaf& leaf) const noexcept {
    return leaf.deviation_m == 0 && !leaf.has_holes
               ? step_exponent
               : std::countr_zero(static_cast<unsigned>(leaf.step));
  }
};

/// Cells of a leaf, 2^exponent cells of the DEM wide: their number and the positions of their
/// points.
struct LeafCells {
  const LevelView& level;
  const Leaf& leaf;
  int exponent = std::countr_zero(static_cast<unsigned>(leaf.step));
  int columns = count(leaf.column, level.last.x);
  int rows = count(leaf.row, level.last.y);
  /// Thinned sides are respected only if the cells are the leaf's own.
  ThinnedBlock block{{columns, rows},
                     (1 << exponent) == leaf.step ? leaf.coarser : std::uint8_t{0}};

  int count(int from, int last) const noexcept {
    const int end = std::min(from + level.leaf_cells * leaf.step, last);
    return (end - from + (1 << exponent) - 1) >> exponent;
  }
  int column(int i) const noexcept { return std::min(leaf.column + (i << exponent), level.last.x); }
  int row(int j) const noexcept { return std::min(leaf.row + (j << exponent), level.last.y); }
  /// Returns the height of a sample.
  float height_m(glm::ivec2 point) const noexcept {
    return level.height_m(column(point.x), row(point.y));
  }

  /// Returns true if a point is omitted because the neighbour is coarser.
  bool drops(glm::ivec2 p) const noexcept { return block.drops(p.x, p.y); }

  /// Returns true if an omitted point lies on the leaf's first or last row.
  bool drops_in_row(glm::ivec2 p) const noexcept {
    return p.x % 2 == 1 && (p.y == 0 || p.y == rows);
  }

  /// Returns the height of the surface at a point: that of the sample or, if it is omitted, of the
  /// line between its neighbours along the boundary.
  double surface_m(glm::ivec2 p) const noexcept {
    if (!drops(p)) return height_m(p);
    const bool in_row = drops_in_row(p);
    const glm::ivec2 step(in_row ? 1 : 0, in_row ? 0 : 1), a = p - step, b = p + step;
    const int before = in_row ? column(a.x) : row(a.y), after = in_row ? column(b.x) : row(b.y);
    const int at = in_row ? column(p.x) : row(p.y);
    const double a_m = height_m(a);
    return a_m + (height_m(b) - a_m) * (static_cast<double>(at - before) / (after - before));
  }

  /// Returns cell (i, j).
  Cell cell(int i, int j) const noexcept {
    const int west = column(i), north = row(j), width = column(i + 1) - west,
              height = row(j + 1) - north;
    if (leaf.coarser == 0 && width == 1 << exponent && height == width) {
      const int size = width >> level.step_exponent;
      const int x = (west - level.first.x) >> level.step_exponent;
      const int y = (north - level.first.y) >> level.step_exponent;
      return {.column = west,
              .row = north,
              .width = width,
              .height = height,
              .nw = level.point_m(x, y),
              .ne = level.point_m(x + size, y),
              .sw = level.point_m(x, y + size),
              .se = level.point_m(x + size, y + size)};
    }
    return {.column = west,
            .row = north,
            .width = width,
            .height = height,
            .nw = surface_m({i, j}),
            .ne = surface_m({i + 1, j}),
            .sw = surface_m({i, j + 1}),
            .se = surface_m({i + 1, j + 1}),
            .split = block.splits_along_main(i, j) ? Cell::Split::NorthWestToSouthEast
                                                   : Cell::Split::NorthEastToSouthWest};
  }
  /// Returns the cell that contains a cell of the DEM.
  Cell cell_at(int of_column, int of_row) const noexcept {
    return cell((of_column - leaf.column) >> exponent, (of_row - leaf.row) >> exponent);
  }
};

}  // namespace groundray
