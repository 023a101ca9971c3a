#pragma once

#include <cstdint>
#include <glm/vec2.hpp>

namespace groundray {

/// Leaf of the terrain's quadtree: a square of up to B x B cells, each `step` cells of the DEM wide
/// and split along the same diagonal as those. Cells at the DEM's last column or row may be
/// narrower.
struct Leaf {
  /// Sides, as bits: north is row 0, west is column 0.
  enum Side : std::uint8_t { North = 1, East = 2, South = 4, West = 8 };

  std::int32_t column = 0;  ///< of its first sample, in the DEM
  std::int32_t row = 0;
  std::int32_t step = 1;     ///< a power of two
  std::uint8_t coarser = 0;  ///< sides whose neighbour's cells are twice as wide
  bool has_holes = false;    ///< true if some of its samples, or of the DEM's below it, are missing
  float deviation_m = 0;     ///< largest vertical distance from the reference surface
  float high_m = 0;          ///< highest sample of the DEM in the leaf

  /// Returns true if triangles may lie over holes of the DEM, or be missing where it has ground.
  constexpr bool bridges() const noexcept { return has_holes && (step > 1 || coarser != 0); }
  friend bool operator==(const Leaf&, const Leaf&) = default;
};

/// Rule of thinned sides, for the cells of a leaf or node (pictures: terrain/lod/passes/README.md):
/// every second point of such a side is omitted, and one cell of each pair at it is split along the
/// other diagonal. A pair that the DEM's boundary cuts off has one cell and omits no point.
struct ThinnedBlock {
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

}  // namespace groundray
