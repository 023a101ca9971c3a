#pragma once

#include <cstdint>
#include <glm/vec2.hpp>

#include "core/tracing/leaf.h"

namespace groundray::passes {

// The 16 templates of a node (pictures: README.md). Every cell is two triangles, its halves. On a
// thinned side, cells form pairs, counted from the node's north-western corner. The point omitted
// between the cells of a pair is replaced by the interpolation of its two neighbours on the
// boundary, which belong to the coarser neighbour's lattice. The two halves that share it along the
// boundary then lie in one plane.

/// Corner of a cell, and the half of the cell that it alone belongs to. Cells split along the
/// anti-diagonal (north-east to south-west) have the halves NorthWest and SouthEast, those split
/// along the main diagonal SouthWest and NorthEast.
enum Corner : std::uint8_t { NorthWest, NorthEast, SouthWest, SouthEast };

constexpr bool is_of_anti_diagonal(Corner half) noexcept {
  return half == NorthWest || half == SouthEast;
}

/// Pair of cells on a thinned side; the first is the northern or western one.
struct ThinnedPair {
  Corner begin, end;     ///< of the first and the second cell: ends of the side
  Corner first, second;  ///< halves with the omitted point, which is the corner that names them
  Corner plain;          ///< other half of the cell that is split along its main diagonal
  bool plain_is_in_first;
};

constexpr ThinnedPair thinned_pair(Leaf::Side side) noexcept {
  switch (side) {
    case Leaf::North:
      return {NorthWest, NorthEast, NorthEast, NorthWest, SouthWest, true};
    case Leaf::West:
      return {NorthWest, SouthWest, SouthWest, NorthWest, NorthEast, true};
    case Leaf::South:
      return {SouthWest, SouthEast, SouthEast, SouthWest, NorthEast, false};
    default:
      return {NorthEast, SouthEast, SouthEast, NorthEast, SouthWest, false};
  }
}

/// Calls `act` with the three points of each triangle of a row of cells, counter-clockwise as seen
/// from above with columns to the east and rows to the south. Points lie in rows `row` to `row`
/// + 2.
template <typename Act>
void for_each_triangle_of_row(const ThinnedBlock& block, int row, const Act& act) noexcept {
  for (int column = 0; column < block.cells.x; ++column) {
    glm::ivec2 north_west{column, row};
    glm::ivec2 north_east{column + 1, row};
    glm::ivec2 south_west{column, row + 1};
    glm::ivec2 south_east{column + 1, row + 1};
    // Two halves that share an omitted point along the boundary are one triangle, emitted with
    // the first of them.
    if (!block.splits_along_main(column, row)) {
      if (!block.drops(column, row)) act(north_west, south_west, north_east);
      if (block.drops(column + 1, row + 1)) {
        (row + 1 == block.cells.y ? south_east.x : south_east.y) += 1;
      }
      act(south_east, north_east, south_west);
    } else {
      const bool drops_south_west = block.drops(column, row + 1);
      if (drops_south_west && column == 0) south_west.y += 1;
      if (!drops_south_west || column == 0) act(north_west, south_west, south_east);
      const bool drops_north_east = block.drops(column + 1, row);
      if (drops_north_east && row == 0) north_east.x += 1;
      if (!drops_north_east || row == 0) act(north_east, north_west, south_east);
    }
  }
}

/// Calls `act` with the three points of each triangle of a block.
template <typename Act>
void for_each_triangle(const ThinnedBlock& block, const Act& act) noexcept {
  for (int row = 0; row < block.cells.y; ++row) for_each_triangle_of_row(block, row, act);
}

}  // namespace groundray::passes
