#pragma once

// Private to the library: the ground of all cells of a tile.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <limits>
#include <span>
#include <vector>

#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/fusion/cell_surfaces.h"
#include "reconstruction/dem/fusion/packed_point.h"

namespace groundray {

/// Tiles of a rectangle of cells, in row order. Each tile is extended by a margin of `margin` cells
/// on each side, so that its own cells are processed without the neighbouring tiles.
class CellTiling {
 public:
  static constexpr int margin = 3;
  static constexpr int width = 256;  ///< maximum width of a tile with its margin, cells
  static constexpr int largest_edge = width - 2 * margin;
  /// Smallest edge with which no cell is in the margins of two tiles on one side.
  static constexpr int smallest_edge = 2 * margin;

  /// @param first  first cell of the rectangle.
  /// @param size  columns and rows of the rectangle.
  /// @param edge  cells along a side of a tile without its margin: smallest_edge to largest_edge.
  CellTiling(glm::ivec2 first, glm::ivec2 size, int edge) noexcept
      : first_(first), size_(size), edge_(edge), tiles_((size - 1) / edge + 1) {}

  int edge() const noexcept { return edge_; }
  glm::ivec2 tiles() const noexcept { return tiles_; }
  std::size_t count() const noexcept {
    return static_cast<std::size_t>(tiles_.x) * static_cast<std::size_t>(tiles_.y);
  }
  glm::ivec2 place(std::size_t tile) const noexcept {
    const auto columns = static_cast<std::size_t>(tiles_.x);
    return {static_cast<int>(tile % columns), static_cast<int>(tile / columns)};
  }
  glm::ivec2 first_cell(std::size_t tile) const noexcept { return first_ + place(tile) * edge_; }
  glm::ivec2 cells(std::size_t tile) const noexcept {
    const glm::ivec2 left = size_ - place(tile) * edge_;
    return {std::min(edge_, left.x), std::min(edge_, left.y)};
  }

  /// Calls visit(tile, cell) for each tile that contains `cell`, also in its margin, with the
  /// number of the cell in that tile: 256 row + column, counted from the first cell of the margin.
  template <typename Visit>
  void for_each_view(glm::ivec2 cell, const Visit& visit) const {
    const glm::ivec2 at = cell - first_ + margin;  // never negative
    // `next` is the cell's tile, or the next one if the cell is in that one's margin.
    const glm::ivec2 last_tile = tiles_ - 1, next = at / edge_;
    const int left = next.x - (next.x > 0 && at.x - next.x * edge_ < 2 * margin ? 1 : 0);
    const int low = next.y - (next.y > 0 && at.y - next.y * edge_ < 2 * margin ? 1 : 0);
    const int right = std::min(next.x, last_tile.x), high = std::min(next.y, last_tile.y);
    for (int row = low; row <= high; ++row) {
      for (int column = left; column <= right; ++column) {
        visit(static_cast<std::size_t>(row) * static_cast<std::size_t>(tiles_.x) +
                  static_cast<std::size_t>(column),
              static_cast<std::uint16_t>((at.y - row * edge_) * width + at.x - column * edge_));
      }
    }
  }

 private:
  glm::ivec2 first_, size_;
  int edge_;
  glm::ivec2 tiles_;
};

/// Parameters for fitting a tile; see FusionOptions.
struct TileRules {
  glm::dvec2 step_m{1};
  double gap_m = 0;
  double steepest_slope = 0;
  double slope_sd = 0;
  double most_sd_m = std::numeric_limits<double>::infinity();
  OutlierRule outliers;
};

/// Numbers of cells that have points but stay unmeasured.
struct TileCounts {
  std::uint64_t without_ground = 0;
  std::uint64_t uncertain = 0;  ///< cells whose ground has a larger sd than most_sd_m
};

/// Points in several pieces of memory.
using PointParts = std::vector<std::span<const PackedPoint>>;

/// Fits each cell of a tile to its points and writes it to its position in `layers`.
/// @param parts  points of the tile and its margin, in any order, which does not affect the result.
/// @param size  columns and rows of the tile without its margin.
/// @param first  first cell of the tile in `layers`.
TileCounts fit_tile(const PointParts& parts, glm::ivec2 size, glm::ivec2 first,
                    const TileRules& rules, DemLayers& layers);

}  // namespace groundray
