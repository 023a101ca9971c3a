#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "core/tracing/leaf.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/border_thinning.h"
#include "terrain/lod/passes/leaf_tree.h"
#include "terrain/lod/passes/vertex_numbers.h"

namespace groundray::passes {

/// Writes the index of each leaf in the list to its node.
struct NumberLeavesPass {
  static constexpr char name[] = "NumberLeavesPass";

  LeafTree tree;

  void operator()(std::size_t index) const noexcept {
    const LeafBlock leaf = tree.block_of(tree.leaves[index]);
    const glm::ivec2 node{leaf.first_cell.x / tree.block_cells,
                          leaf.first_cell.y / tree.block_cells};
    tree.levels[leaf.level].leaf[tree.node_index(leaf.level, node)] =
        static_cast<std::uint32_t>(index);
  }
};

/// Counts the vertices that each leaf owns, and its triangles.
struct CountMeshPass {
  static constexpr char name[] = "CountMeshPass";

  VertexNumbers numbers;  ///< without `first`
  std::uint32_t* vertices;
  std::uint32_t* triangles;

  void operator()(std::size_t index) const noexcept {
    const LeafTree& tree = numbers.tree;
    const LeafBlock leaf = tree.block_of(tree.leaves[index]);
    vertices[index] =
        numbers.is_marked(index)
            ? tree.marked_before(numbers.marks, numbers.mark_of[index], tree.mark_words() * 64)
            : leaf.own_points_before({0, leaf.own_points.y});
    if (!tree.leaves[index].has_holes) {
      triangles[index] = leaf.triangle_count();
      return;
    }
    std::uint32_t count = 0;
    for_each_triangle(leaf.block, [&](glm::ivec2 a, glm::ivec2 b, glm::ivec2 c) {
      count += tree.has_all(leaf, a, b, c) ? 1 : 0;
    });
    triangles[index] = count;
  }
};

/// Writes the vertices that each leaf owns.
struct EmitVerticesPass {
  static constexpr char name[] = "EmitVerticesPass";

  VertexNumbers numbers;
  glm::ivec2* vertices;

  void operator()(std::size_t index) const noexcept {
    const LeafTree& tree = numbers.tree;
    const LeafBlock leaf = tree.block_of(tree.leaves[index]);
    const glm::ivec2 points = numbers.points(index, leaf);
    for (int row = 0; row < points.y; ++row) {
      for (int column = 0; column < points.x; ++column) {
        if (!numbers.has(index, leaf, column, row)) continue;
        vertices[numbers.of_own(index, leaf, column, row)] = tree.sample(leaf, column, row);
      }
    }
  }
};

/// Writes the triangles of each leaf. Keeps the vertex numbers of three rows of points, so that an
/// index needs less than 2 kB of private memory.
struct EmitTrianglesPass {
  static constexpr char name[] = "EmitTrianglesPass";

  VertexNumbers numbers;
  const std::uint32_t* first;  ///< index of each leaf's first triangle
  bool is_mirrored = false;    ///< true if columns and rows run clockwise as seen from above
  glm::uvec3* triangles;
  std::uint8_t* levels;

  void operator()(std::size_t index) const noexcept {
    const LeafTree& tree = numbers.tree;
    const LeafBlock leaf = tree.block_of(tree.leaves[index]);
    const bool has_holes = tree.leaves[index].has_holes;
    std::uint32_t row_numbers[rows][Lattice::max_block_cells + 1];
    std::uint32_t* at[rows] = {row_numbers[0], row_numbers[1], row_numbers[2]};  // from `row` on
    int next = 0;  // row whose points are numbered next
    std::size_t out = first[index];
    for (int row = 0; row < leaf.block.cells.y; ++row) {
      for (; next <= leaf.block.cells.y && next < row + rows; ++next) {
        for (int column = 0; column <= leaf.block.cells.x; ++column) {
          if (leaf.block.drops(column, next)) continue;
          const bool is_missing = has_holes && tree.is_missing(tree.sample(leaf, column, next));
          at[next - row][column] = is_missing ? missing : numbers.of(index, leaf, {column, next});
        }
      }
      for_each_triangle_of_row(leaf.block, row, [&](glm::ivec2 a, glm::ivec2 b, glm::ivec2 c) {
        const std::uint32_t i = at[a.y - row][a.x];
        const std::uint32_t j = at[b.y - row][b.x];
        const std::uint32_t k = at[c.y - row][c.x];
        if (has_holes && std::max({i, j, k}) == missing) return;
        triangles[out] = is_mirrored ? glm::uvec3{i, k, j} : glm::uvec3{i, j, k};
        levels[out] = static_cast<std::uint8_t>(leaf.level);
        ++out;
      });
      std::uint32_t* const first_row = at[0];
      at[0] = at[1];
      at[1] = at[2];
      at[2] = first_row;
    }
  }

 private:
  static constexpr int rows = 3;  // that a row of cells may refer to
  static constexpr std::uint32_t missing = ~std::uint32_t{0};
};

}  // namespace groundray::passes
