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

}  // namespace groundray::passes
