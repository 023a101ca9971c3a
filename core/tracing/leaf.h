#pragma once

#include <cstdint>

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

}  // namespace groundray
