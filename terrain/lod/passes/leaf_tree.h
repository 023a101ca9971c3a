#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "core/tracing/leaf.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/border_thinning.h"

namespace groundray::passes {

/// Leaf with the data that the mesh needs.
struct LeafBlock {
  int level = 0;
  glm::ivec2 first_cell{0};  ///< on the lattice of its level
  ThinnedBlock block;
  glm::ivec2 own_points{2};  ///< columns and rows of points in its half-open square

  /// Returns the number of the leaf's own points that come before `point`, row by row. Only for a
  /// leaf without holes.
  std::uint32_t own_points_before(glm::ivec2 point) const noexcept {
    const bool north = block.thins(Leaf::North);
    const bool west = block.thins(Leaf::West);
    int dropped = 0;
    if (north) dropped += point.y > 0 ? block.cells.x / 2 : point.x / 2;
    if (west) {
      dropped += std::min(point.y, block.cells.y) / 2;
      if (point.x > 0 && block.drops(0, point.y)) ++dropped;
    }
    return static_cast<std::uint32_t>(point.y * own_points.x + point.x - dropped);
  }
  std::uint32_t triangle_count() const noexcept {
    int count = 2 * block.cells.x * block.cells.y;
    for (const Leaf::Side side : {Leaf::North, Leaf::South}) {
      if (block.thins(side)) count -= block.cells.x / 2;
    }
    for (const Leaf::Side side : {Leaf::West, Leaf::East}) {
      if (block.thins(side)) count -= block.cells.y / 2;
    }
    return static_cast<std::uint32_t>(count);
  }
};

/// Quadtree with a list of its leaves in a part of the DEM: a window, except for that of the next
/// finer level. No leaf lies partly inside either.
struct LeafTree {
  struct Level {
    const std::uint8_t* state = nullptr;
    std::uint32_t* leaf = nullptr;  ///< index of a leaf in the list; undefined for other nodes
    glm::ivec2 first{0};
    int columns = 0;
  };

  glm::ivec2 samples{2};  ///< columns and rows of the DEM
  HeightWindow heights;   ///< points of a level that contain those of the leaves
  int heights_level = 0;
  Rectangle window;  ///< cells of the DEM
  Rectangle finer;   ///< those of the next finer window
  int block_cells = 2;
  Level levels[Lattice::max_levels];
  const Leaf* leaves = nullptr;

  glm::ivec2 last_sample() const noexcept { return samples - 1; }
  glm::ivec2 cells(int level) const noexcept {
    return {((samples.x - 2) >> level) + 1, ((samples.y - 2) >> level) + 1};
  }
  /// Returns whether a cell of the DEM belongs to a leaf in the list.
  bool holds(glm::ivec2 cell) const noexcept { return window.holds(cell) && !finer.holds(cell); }
  std::size_t node_index(int level, glm::ivec2 node) const noexcept {
    const Level& at = levels[level];
    return static_cast<std::size_t>(node.y - at.first.y) * static_cast<std::size_t>(at.columns) +
           static_cast<std::size_t>(node.x - at.first.x);
  }
  bool is_missing(glm::ivec2 sample) const noexcept {
    // Rounded up, because the DEM's last sample is the last point of any level.
    const int rounding = (1 << heights_level) - 1;
    return std::isnan(*heights.at((sample.x + rounding) >> heights_level,
                                  (sample.y + rounding) >> heights_level));
  }

  LeafBlock block_of(const Leaf& leaf) const noexcept {
    const int level = std::countr_zero(static_cast<std::uint32_t>(leaf.step));
    const glm::ivec2 first{leaf.column >> level, leaf.row >> level};
    const glm::ivec2 all = cells(level);
    const glm::ivec2 count{std::min(block_cells, all.x - first.x),
                           std::min(block_cells, all.y - first.y)};
    return {level,
            first,
            {count, leaf.coarser},
            {count.x + (first.x + count.x == all.x ? 1 : 0),
             count.y + (first.y + count.y == all.y ? 1 : 0)}};
  }
  /// Returns the sample at a point of a leaf.
  glm::ivec2 sample(const LeafBlock& leaf, int column, int row) const noexcept {
    return {std::min((leaf.first_cell.x + column) << leaf.level, last_sample().x),
            std::min((leaf.first_cell.y + row) << leaf.level, last_sample().y)};
  }
  /// Returns the position of a sample among the points of a leaf that contains it.
  glm::ivec2 point(const LeafBlock& leaf, glm::ivec2 sample) const noexcept {
    const glm::ivec2 cell{sample.x >> leaf.level, sample.y >> leaf.level};
    const glm::ivec2 last = last_sample();
    return {sample.x == last.x ? leaf.block.cells.x : cell.x - leaf.first_cell.x,
            sample.y == last.y ? leaf.block.cells.y : cell.y - leaf.first_cell.y};
  }

  /// Returns the leaf that contains a cell of the DEM; the search begins at `level`.
  std::uint32_t leaf_at(glm::ivec2 cell, int level) const noexcept {
    while (true) {
      const glm::ivec2 node{(cell.x >> level) / block_cells, (cell.y >> level) / block_cells};
      const std::size_t index = node_index(level, node);
      const std::uint8_t state = levels[level].state[index];
      if ((state & NodeState::IsLeaf) != 0) return levels[level].leaf[index];
      level += (state & NodeState::Split) != 0 ? -1 : 1;
    }
  }
  /// Returns the leaf in the list that owns a sample on one of them: the leaf of its south-eastern
  /// cell or, if that is not in the list, of the first other one that is.
  std::uint32_t owner_of(glm::ivec2 sample, int level) const noexcept {
    glm::ivec2 cell = sample;
    for (int i = 0; i < 3 && !holds(cell); ++i)
      cell = sample - glm::ivec2{(i + 1) % 2, (i + 1) / 2};
    return leaf_at(cell, level);
  }
  /// Returns whether a leaf may own points that are not in its half-open square, or may own points
  /// without vertices.
  bool needs_marks(const Leaf& leaf) const noexcept {
    const LeafBlock at = block_of(leaf);
    const glm::ivec2 end = sample(at, at.block.cells.x, at.block.cells.y);
    const bool ends_window = (end.x == window.end.x && end.x != last_sample().x) ||
                             (end.y == window.end.y && end.y != last_sample().y);
    const bool meets_finer = finer.first.x <= end.x && finer.first.y <= end.y &&
                             leaf.column < finer.end.x && leaf.row < finer.end.y;
    return leaf.has_holes || ends_window || meets_finer;
  }

  /// Returns whether the three samples of one half of a leaf's cell exist. An omitted point exists
  /// if the two points that it lies between do.
  bool half_exists(const LeafBlock& leaf, glm::ivec2 cell, Corner half) const noexcept {
    for (const Corner corner : {NorthWest, NorthEast, SouthWest, SouthEast}) {
      if (corner + half == 3) continue;  // the opposite corner
      const int column = cell.x + corner % 2;
      const int row = cell.y + corner / 2;
      if (!leaf.block.drops(column, row)) {
        if (is_missing(sample(leaf, column, row))) return false;
        continue;
      }
      const int dx = row == 0 || row == leaf.block.cells.y ? 1 : 0;
      const int dy = 1 - dx;
      if (is_missing(sample(leaf, column - dx, row - dy)) ||
          is_missing(sample(leaf, column + dx, row + dy))) {
        return false;
      }
    }
    return true;
  }
  bool has_all(const LeafBlock& leaf, glm::ivec2 a, glm::ivec2 b, glm::ivec2 c) const noexcept {
    return !is_missing(sample(leaf, a.x, a.y)) && !is_missing(sample(leaf, b.x, b.y)) &&
           !is_missing(sample(leaf, c.x, c.y));
  }

  // Marks of a leaf's points: one bit each, row by row.
  std::size_t mark_bit(int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * (static_cast<std::size_t>(block_cells) + 1) +
           static_cast<std::size_t>(column);
  }
  std::size_t mark_words() const noexcept { return (mark_bit(0, block_cells + 1) + 63) / 64; }
  /// Returns the number of marks of leaf `which` before a bit.
  std::uint32_t marked_before(const std::uint64_t* marks, std::uint32_t which,
                              std::size_t bit) const noexcept {
    const std::uint64_t* const words = marks + which * mark_words();
    int count = 0;
    for (std::size_t word = 0; word < bit / 64; ++word) count += std::popcount(words[word]);
    if (bit % 64 != 0) {
      count += std::popcount(words[bit / 64] & ((std::uint64_t{1} << (bit % 64)) - 1));
    }
    return static_cast<std::uint32_t>(count);
  }
};

}  // namespace groundray::passes
