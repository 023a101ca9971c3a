#pragma once

#include <cmath>
#include <glm/vec2.hpp>

#include "core/tracing/leaf.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/border_thinning.h"
#include "terrain/lod/passes/half_cell.h"
#include "terrain/lod/passes/level_grid.h"
#include "terrain/lod/passes/node_arrays.h"

namespace groundray::passes {

/// Deviations of any node of a level, evaluated half by half and row by row.
struct NodeDeviation {
  const HeightWindow& samples;
  const Points& points;
  const LevelGrid& grid;

  /// Returns the deviations of the part of a node that lies in the band.
  Deviations of(glm::ivec2 node, const Band& band) const noexcept {
    const glm::ivec2 first = node * grid.block_cells;
    const glm::ivec2 cells = grid.cells_of(node);
    Deviations worst;
    if (grid.level > 0) worst.full = worst_of_cells(first, cells, band);
    const glm::ivec2 last = first + cells - 1;
    for (int c = 0; c + 1 < cells.x; c += 2) {
      if (first.y > 0) add_pair(Leaf::North, {first.x + c, first.y}, band, worst);
      if (last.y + 1 < grid.cells.y) add_pair(Leaf::South, {first.x + c, last.y}, band, worst);
    }
    for (int c = 0; c + 1 < cells.y; c += 2) {
      if (first.x > 0) add_pair(Leaf::West, {first.x, first.y + c}, band, worst);
      if (last.x + 1 < grid.cells.x) add_pair(Leaf::East, {last.x, first.y + c}, band, worst);
    }
    return worst;
  }

 private:
  HalfCell half_cell(glm::ivec2 cell, const Band& band) const noexcept {
    return {samples, grid.shape(cell), grid.corner(cell), band};
  }

  Corners corners(glm::ivec2 cell) const noexcept {
    return {{points.at(cell.x, cell.y), points.at(cell.x + 1, cell.y),
             points.at(cell.x, cell.y + 1), points.at(cell.x + 1, cell.y + 1)}};
  }

  /// Returns whether the cell is outside the band or the window's columns.
  bool misses(glm::ivec2 cell, const Band& band) const noexcept {
    const CellShape& shape = grid.shape(cell);
    const glm::ivec2 at = grid.corner(cell);
    return at.y >= band.end || at.y + shape.height < band.begin ||
           at.x >= samples.first.x + samples.size.x || at.x + shape.width < samples.first.x;
  }

  double worst_of_cells(glm::ivec2 first, glm::ivec2 cells, const Band& band) const noexcept {
    double worst = 0;
    for (int row = first.y; row < first.y + cells.y; ++row) {
      for (int column = first.x; column < first.x + cells.x; ++column) {
        if (misses({column, row}, band)) continue;
        const HalfCell cell = half_cell({column, row}, band);
        const Corners at = corners({column, row});
        worst = larger(worst, cell.deviation(NorthWest, at));
        worst = larger(worst, cell.deviation(SouthEast, at));
      }
    }
    return worst;
  }

  /// Adds the deviations of cell `a` and the next one along a thinned side (see border_thinning.h).
  void add_pair(Leaf::Side side, glm::ivec2 a, const Band& band, Deviations& worst) const noexcept {
    const bool is_row = side == Leaf::North || side == Leaf::South;
    const glm::ivec2 b = is_row ? glm::ivec2{a.x + 1, a.y} : glm::ivec2{a.x, a.y + 1};
    if (misses(a, band) && misses(b, band)) return;
    const ThinnedPair pair = thinned_pair(side);
    const HalfCell first = half_cell(a, band);
    const HalfCell second = half_cell(b, band);
    Corners at_first = corners(a);
    Corners at_second = corners(b);
    worst.thinned =
        larger(worst.thinned, pair.plain_is_in_first ? first.deviation(pair.plain, at_first)
                                                     : second.deviation(pair.plain, at_second));
    const int first_length = is_row ? first.shape.width : first.shape.height;
    const int second_length = is_row ? second.shape.width : second.shape.height;
    double dropped = 0.5 * (at_first[pair.begin] + at_second[pair.end]);
    if (first_length != second_length) {
      dropped = at_first[pair.begin] * second_length + at_second[pair.end] * first_length;
      const double per_factor = is_row ? grid.per_pair.x : grid.per_pair.y;
      at_first.scale(first_length + second_length, per_factor);
      at_second.scale(first_length + second_length, per_factor);
    }
    at_first.height[pair.first] = dropped;
    at_second.height[pair.second] = dropped;
    worst.thinned = larger(worst.thinned, first.deviation(pair.first, at_first));
    worst.thinned = larger(worst.thinned, second.deviation(pair.second, at_second));
  }
};

}  // namespace groundray::passes
