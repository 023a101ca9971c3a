#pragma once

#include <cstdint>
#include <glm/vec2.hpp>

#include "core/tracing/leaf.h"

namespace groundray::passes {

// The 16 templates of a node. Every cell is two triangles, its halves. On a thinned side, cells
// form pairs, counted from the node's north-western corner. The boundary point between the cells of
// a pair is omitted: it is replaced by the interpolation of its two neighbours on the boundary,
// which belong to the coarser neighbour's lattice. The two halves that share it along the boundary
// then lie in one plane. One cell of the pair is split along its main diagonal, so that those
// halves have the opposite corner in common:
//
//      o0 --- o1 --- o2          o0 --------- o2
//      |    / |    / |           | \        / |
//      |  /   |  /   |    =>     |   \    /   |        (thinned in the north)
//      |/     |/     |           |     \/     |
//      i0 --- i1 --- i2          i0 -- i1 --- i2
//
// A pair cut off by the DEM's boundary has one cell and omits no point.

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

/// Block of cells of a node under one of the templates.
struct Block {
  glm::ivec2 cells{2};       ///< columns and rows
  std::uint8_t thinned = 0;  ///< thinned sides, as Leaf::Side

  constexpr bool thins(Leaf::Side side) const noexcept { return (thinned & side) != 0; }

  /// Returns whether a point is omitted.
  constexpr bool drops(int column, int row) const noexcept {
    const bool odd_column = column % 2 == 1 && column < cells.x;
    const bool odd_row = row % 2 == 1 && row < cells.y;
    return (odd_column &&
            ((row == 0 && thins(Leaf::North)) || (row == cells.y && thins(Leaf::South)))) ||
           (odd_row &&
            ((column == 0 && thins(Leaf::West)) || (column == cells.x && thins(Leaf::East))));
  }

  /// Returns whether a cell is split along its main diagonal.
  constexpr bool splits_along_main(int column, int row) const noexcept {
    return (row == 0 && thins(Leaf::North) && column % 2 == 0 && column + 1 < cells.x) ||
           (column == 0 && thins(Leaf::West) && row % 2 == 0 && row + 1 < cells.y) ||
           (row == cells.y - 1 && thins(Leaf::South) && column % 2 == 1) ||
           (column == cells.x - 1 && thins(Leaf::East) && row % 2 == 1);
  }
};

}  // namespace groundray::passes
