#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>

#include "core/tracing/leaf.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/border_thinning.h"
#include "terrain/lod/passes/leaf_tree.h"

namespace groundray::passes {

/// Numbers of vertices: leaf by leaf, and row by row among each leaf's own points.
struct VertexNumbers {
  static constexpr std::uint32_t unmarked = ~std::uint32_t{0};

  LeafTree tree;
  const std::uint32_t* first = nullptr;    ///< number of each leaf's first own vertex
  const std::uint64_t* marks = nullptr;    ///< see MarkVerticesPass
  const std::uint32_t* mark_of = nullptr;  ///< index of each leaf among the marked ones; or null

  bool is_marked(std::size_t index) const noexcept {
    return mark_of != nullptr && mark_of[index] != unmarked;
  }
  /// Returns the columns and rows of a leaf's points among which its own are.
  glm::ivec2 points(std::size_t index, const LeafBlock& leaf) const noexcept {
    return is_marked(index) ? leaf.block.cells + 1 : leaf.own_points;
  }
  /// Returns whether one of `points` is a vertex that the leaf owns.
  bool has(std::size_t index, const LeafBlock& leaf, int column, int row) const noexcept {
    if (!is_marked(index)) return !leaf.block.drops(column, row);
    const std::size_t bit = tree.mark_bit(column, row);
    return (marks[mark_of[index] * tree.mark_words() + bit / 64] >> (bit % 64) & 1) != 0;
  }
  std::uint32_t of_own(std::size_t index, const LeafBlock& leaf, int column,
                       int row) const noexcept {
    return first[index] +
           (is_marked(index) ? tree.marked_before(marks, mark_of[index], tree.mark_bit(column, row))
                             : leaf.own_points_before({column, row}));
  }
  /// Returns the number of a vertex of leaf `index`, whichever leaf owns it.
  std::uint32_t of(std::size_t index, const LeafBlock& leaf, glm::ivec2 point) const noexcept {
    if (point.x < leaf.own_points.x && point.y < leaf.own_points.y) {
      return of_own(index, leaf, point.x, point.y);
    }
    const glm::ivec2 sample = tree.sample(leaf, point.x, point.y);
    const std::uint32_t owner = tree.owner_of(sample, leaf.level);
    const LeafBlock own = tree.block_of(tree.leaves[owner]);
    const glm::ivec2 at = tree.point(own, sample);
    return of_own(owner, own, at.x, at.y);
  }
};

/// Counts 1 for each leaf that needs marks, otherwise 0.
struct CountMarkedPass {
  static constexpr char name[] = "CountMarkedPass";

  LeafTree tree;
  std::uint32_t* counts;

  void operator()(std::size_t index) const noexcept {
    counts[index] = tree.needs_marks(tree.leaves[index]) ? 1 : 0;
  }
};

/// Lists the leaves that need marks.
struct ListMarkedPass {
  static constexpr char name[] = "ListMarkedPass";

  LeafTree tree;
  std::uint32_t* mark_of;  ///< prefix sums of the counts; becomes VertexNumbers::mark_of
  std::uint32_t* marked;

  void operator()(std::size_t index) const noexcept {
    if (tree.needs_marks(tree.leaves[index])) {
      marked[mark_of[index]] = static_cast<std::uint32_t>(index);
    } else {
      mark_of[index] = VertexNumbers::unmarked;
    }
  }
};

/// Marks the points that a leaf owns and that are vertices of triangles, its own or its
/// neighbours': one bit per point.
struct MarkVerticesPass {
  static constexpr char name[] = "MarkVerticesPass";

  LeafTree tree;
  const std::uint32_t* marked;  ///< indices in the list of the leaves that need marks
  std::uint64_t* marks;

  void operator()(std::size_t index) const noexcept {
    const std::uint32_t which = marked[index];
    const LeafBlock leaf = tree.block_of(tree.leaves[which]);
    std::uint64_t* const out = marks + index * tree.mark_words();
    for (int row = 0; row <= leaf.block.cells.y; ++row) {
      for (int column = 0; column <= leaf.block.cells.x; ++column) {
        if (!leaf.block.drops(column, row) && is_own(which, leaf, column, row) &&
            (!tree.leaves[which].has_holes || is_used(leaf, column, row))) {
          const std::size_t bit = tree.mark_bit(column, row);
          out[bit / 64] |= std::uint64_t{1} << (bit % 64);
        }
      }
    }
  }

 private:
  bool is_own(std::uint32_t which, const LeafBlock& leaf, int column, int row) const noexcept {
    if (column < leaf.own_points.x && row < leaf.own_points.y) return true;
    const glm::ivec2 at = tree.sample(leaf, column, row);
    // A missing sample may be that of a leaf without any height, which is not in the list.
    return !tree.is_missing(at) && tree.owner_of(at, leaf.level) == which;
  }
  bool is_used(const LeafBlock& leaf, int column, int row) const noexcept {
    const glm::ivec2 at = tree.sample(leaf, column, row);
    if (tree.is_missing(at)) return false;
    for (const Corner corner : {NorthWest, NorthEast, SouthWest, SouthEast}) {
      // The cell of the DEM that has the sample at this corner.
      const glm::ivec2 cell{at.x - corner % 2, at.y - corner / 2};
      if (!tree.holds(cell)) continue;
      const LeafBlock around = tree.block_of(tree.leaves[tree.leaf_at(cell, leaf.level)]);
      const glm::ivec2 point = tree.point(around, at);
      const glm::ivec2 large_cell{point.x - corner % 2, point.y - corner / 2};
      const bool is_main = around.block.splits_along_main(large_cell.x, large_cell.y);
      // A half without this corner contains the diagonal, whose points form another half with this
      // corner.
      for (const Corner half : {NorthWest, NorthEast, SouthWest, SouthEast}) {
        if (is_main != is_of_anti_diagonal(half) && tree.half_exists(around, large_cell, half)) {
          return true;
        }
      }
    }
    return false;
  }
};

}  // namespace groundray::passes
