#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <vector>

namespace groundray {

/// Rectangle of samples, cells or nodes: columns and rows [first, end).
struct Rectangle {
  glm::ivec2 first{0}, end{0};

  bool holds(glm::ivec2 at) const noexcept {
    return first.x <= at.x && first.y <= at.y && at.x < end.x && at.y < end.y;
  }
  friend bool operator==(const Rectangle&, const Rectangle&) = default;
};

/// Levels of a DEM: level k consists of every 2^k-th sample, so its column i is sample min(i 2^k,
/// last). The last column and row therefore belong to every level, and the last cells of a level
/// may be narrower than the others. A node of level k is a block of block_cells x block_cells cells
/// of that level; node (i, j) of level k has the children (2i..2i+1, 2j..2j+1) of level k-1.
struct Lattice {
  static constexpr int max_block_cells = 64;
  static constexpr int max_levels = 31;

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

/// Certified values of the nodes of one level, row by row (see Lattice). Deviations are largest
/// vertical distances from the reference surface in metres, computed in double and rounded up.
struct NodeLevel {
  glm::ivec2 size{0};
  /// Saturated key: the largest deviation of the node and of all nodes below it. Infinite for a
  /// node with holes, negative for one without any height.
  std::vector<float> key_m;
  /// Largest deviation over all templates of the node that its neighbours can require, i.e. with
  /// any of its sides thinned for a coarser neighbour (16, fewer at the DEM's boundary). For a node
  /// with holes, only where both surfaces exist; a sample or an edge of the DEM without a facet
  /// counts as surface.
  std::vector<float> deviation_m;
  /// Deviation of the node with no side thinned; 0 at level 0.
  std::vector<float> full_m;
  /// Lowest and highest sample of the DEM in the node, metres; +inf and -inf if there is none.
  std::vector<float> low_m, high_m;
};

/// Rectangle of a level's nodes that may be used, with their certified values (see NodeLevel), row
/// by row.
struct NodeWindow {
  glm::ivec2 first{0};  ///< even, as is the end unless it is the lattice's
  glm::ivec2 size{0};
  const float* key_m = nullptr;
  const float* low_m = nullptr;  ///< low_m and high_m: required if the bound has an angle
  const float* high_m = nullptr;
  const float* deviation_m = nullptr;  ///< deviation_m and full_m: for list_leaves
  const float* full_m = nullptr;
};

/// State of a node of the quadtree, as bits. The lowest four are the sides of a leaf that are
/// thinned for a coarser neighbour (Leaf::Side).
struct NodeState {
  enum Bits : std::uint8_t {
    AllSides = 15,
    Split = 16,   ///< replaced by its children
    Tight = 32,   ///< exceeds its bound but cannot be split; not thinned if avoidable
    IsLeaf = 64,  ///< is part of the mesh
    Holed = 128,  ///< some or all samples of the DEM in it are missing
  };
};

/// Rectangle of heights in metres: samples of the DEM, or points of a level of its lattice. Holes
/// are NaN.
struct HeightWindow {
  glm::ivec2 first{0};               ///< column and row of the first height
  glm::ivec2 size{0};                ///< columns and rows
  const float* heights_m = nullptr;  ///< row by row
  std::ptrdiff_t row_stride = 0;     ///< offset of the next row, in heights

  const float* at(int column, int row) const noexcept {
    return heights_m + (row - first.y) * row_stride + (column - first.x);
  }
};

}  // namespace groundray
