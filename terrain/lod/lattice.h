#pragma once

#include <algorithm>
#include <glm/common.hpp>
#include <glm/vec2.hpp>

namespace groundray {

/// Levels of a DEM: level k consists of every 2^k-th sample, so its column i is sample min(i 2^k,
/// last). The last column and row therefore belong to every level, and the last cells of a level
/// may be narrower than the others. A node of level k is a block of block_cells x block_cells cells
/// of that level; node (i, j) of level k has the children (2i..2i+1, 2j..2j+1) of level k-1.
struct Lattice {
  static constexpr int max_block_cells = 64;

  glm::ivec2 samples{2};  ///< columns and rows of the DEM, each 2 to 2^30
  int block_cells = 8;    ///< even, at most max_block_cells

  /// Returns the level at which the DEM is one cell: the root of the quadtree.
  int top_level() const noexcept {
    int level = 0;
    while ((1 << level) < std::max(samples.x, samples.y) - 1) ++level;
    return level;
  }
  /// Returns the number of columns and rows of cells.
  glm::ivec2 cells(int level) const noexcept { return ((samples - 2) >> level) + 1; }
  /// Returns the number of columns and rows of samples.
  glm::ivec2 points(int level) const noexcept { return cells(level) + 1; }
  /// Returns the number of columns and rows of nodes.
  glm::ivec2 nodes(int level) const noexcept { return (cells(level) - 1) / block_cells + 1; }
  /// Returns the DEM's sample at a point of a level; points beyond the last are mapped to the last.
  glm::ivec2 sample(int level, glm::ivec2 point) const noexcept {
    const glm::ivec2 last = cells(level);
    return {point.x < last.x ? point.x << level : samples.x - 1,
            point.y < last.y ? point.y << level : samples.y - 1};
  }
  friend bool operator==(const Lattice&, const Lattice&) = default;
};

}  // namespace groundray
