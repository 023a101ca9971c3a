#pragma once

#include <algorithm>
#include <glm/vec2.hpp>
#include <limits>

#include "terrain/lod/lattice.h"

namespace groundray::passes {

/// Shape of a cell of a level: its size in cells of the DEM, and reciprocals that replace
/// divisions. Only cells at the DEM's last column and row may be narrower than the level's step.
struct CellShape {
  int width = 1, height = 1;
  bool is_regular = true;  ///< true if as wide and high as the step, a power of two
  double per_width = 1;    ///< 1 / width
  double per_height = 1;
  double per_area = 1;
  double per_sum = 1;         ///< 1 / (width + height)
  double per_difference = 0;  ///< 1 / |width - height|
};

/// Cells and nodes of one level.
struct LevelGrid {
  int level = 0;
  int block_cells = 2;       ///< cells along a node's side
  glm::ivec2 cells{1};       ///< of the whole level
  CellShape shapes[2][2];    ///< [is in the last column][is in the last row]
  glm::dvec2 per_pair{0.5};  ///< 1 / (step + width or height of the last cells)

  const CellShape& shape(glm::ivec2 cell) const noexcept {
    return shapes[cell.x + 1 == cells.x][cell.y + 1 == cells.y];
  }
  /// Returns the cell's north-western sample.
  glm::ivec2 corner(glm::ivec2 cell) const noexcept { return {cell.x << level, cell.y << level}; }
  glm::ivec2 cells_of(glm::ivec2 node) const noexcept {
    return {std::min(block_cells, cells.x - node.x * block_cells),
            std::min(block_cells, cells.y - node.y * block_cells)};
  }
  /// Returns the node's samples, including those on all its sides.
  Rectangle samples_of(glm::ivec2 node) const noexcept {
    const glm::ivec2 first = node * block_cells;
    const glm::ivec2 last = first + cells_of(node) - 1;
    const CellShape& shape_of_last = shape(last);
    return {corner(first),
            corner(last) + glm::ivec2(shape_of_last.width, shape_of_last.height) + 1};
  }
  /// Returns whether the node has a neighbour on every side; its cells are then regular.
  bool has_all_neighbours(glm::ivec2 node) const noexcept {
    const glm::ivec2 end = (node + 1) * block_cells;
    return node.x > 0 && node.y > 0 && end.x < cells.x && end.y < cells.y;
  }
};

/// Points of a level, stored densely, or as every 2^shift-th sample of the DEM and its last.
struct Points {
  HeightWindow heights;
  int shift = 0;
  glm::ivec2 last{std::numeric_limits<int>::max()};  ///< last sample of the DEM

  double at(int column, int row) const noexcept {
    return *heights.at(std::min(column << shift, last.x), std::min(row << shift, last.y));
  }
};

}  // namespace groundray::passes
