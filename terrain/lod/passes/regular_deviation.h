#pragma once

#include <cmath>
#include <cstddef>

#include "core/tracing/leaf.h"
#include "terrain/lod/passes/border_thinning.h"
#include "terrain/lod/passes/cell_plane.h"
#include "terrain/lod/passes/fine_deviation.h"
#include "terrain/lod/passes/node_arrays.h"

namespace groundray::passes {

// Nodes of small cells that have a neighbour on every side and all of their points. There are many
// of them, and the rows of their halves are short. Both halves of a cell are therefore evaluated at
// once, each sample against the half that it lies in, in loops of constant length.

/// Returns the largest vertical distance between the samples of a cell and its two halves, except
/// on its eastern and southern sides. `first` is the half on the cell's western side.
template <int step, bool is_anti>
double worst_of_cell(const float* heights, std::ptrdiff_t stride, const Plane& first,
                     const Plane& second) noexcept {
  double first_rise[step];
  double second_rise[step];
  double worst[step] = {};
  for (int x = 0; x < step; ++x) {
    first_rise[x] = x * first.slope_x;
    second_rise[x] = x * second.slope_x;
  }
  for (int y = 0; y < step; ++y, heights += stride) {
    const double first_start = first.start + y * first.slope_y;
    const double second_start = second.start + y * second.slope_y;
    const double last = is_anti ? step - y : y;
#pragma omp simd
    for (int x = 0; x < step; ++x) {
      const double in_first = first_start + first_rise[x];
      const double in_second = second_start + second_rise[x];
      const double distance = std::abs((x <= last ? in_first : in_second) - heights[x]);
      worst[x] = distance > worst[x] ? distance : worst[x];
    }
  }
  double all = 0;
  for (int x = 0; x < step; ++x) all = larger(all, worst[x]);
  return all;
}

/// Returns the larger of `worst` and the largest distance between a straight line of the mesh and
/// the `count` - 1 samples between its ends.
inline double worst_of_line(const float* heights, std::ptrdiff_t stride, int count,
                            double per_count, double worst) noexcept {
  const double from = heights[0];
  const double slope = (heights[count * stride] - from) * per_count;
  for (int i = 1; i < count; ++i) {
    worst = larger(worst, std::abs(from + i * slope - heights[i * stride]));
  }
  return worst;
}

/// Node with neighbours on all sides, all of whose points exist; cells are `step` x `step`.
template <int step>
struct RegularNode {
  const float* corner;  ///< north-western sample
  std::ptrdiff_t stride;
  static constexpr double per_step = 1.0 / step;

  const float* sample(int column, int row) const noexcept {
    return corner + step * (row * stride + column);
  }
  double point(int column, int row) const noexcept { return *sample(column, row); }
  Corners corners(int column, int row) const noexcept {
    return {{point(column, row), point(column + 1, row), point(column, row + 1),
             point(column + 1, row + 1)}};
  }
  double worst_of_anti(int column, int row, const Corners& at) const noexcept {
    return worst_of_cell<step, true>(sample(column, row), stride,
                                     plane_of(NorthWest, at, per_step, per_step),
                                     plane_of(SouthEast, at, per_step, per_step));
  }
  double worst_of_main(int column, int row, const Corners& at) const noexcept {
    return worst_of_cell<step, false>(sample(column, row), stride,
                                      plane_of(SouthWest, at, per_step, per_step),
                                      plane_of(NorthEast, at, per_step, per_step));
  }

  /// Returns the largest deviation of the unthinned block.
  double full(int cells) const noexcept {
    double worst = 0;
    for (int row = 0; row < cells; ++row) {
      for (int column = 0; column < cells; ++column) {
        worst = larger(worst, worst_of_anti(column, row, corners(column, row)));
      }
    }
    for (int c = 0; c < cells; ++c) {
      worst = worst_of_line(sample(cells, c), stride, step, per_step, worst);
      worst = worst_of_line(sample(c, cells), 1, step, per_step, worst);
    }
    return worst;
  }

  /// Returns the largest deviation of the cells on thinned sides. All sides are thinned at once,
  /// which yields every half of any template, except those that two sides replace.
  double thinned(int cells) const noexcept {
    const ThinnedBlock block{{cells, cells}, Leaf::North | Leaf::East | Leaf::South | Leaf::West};
    double worst = 0;
    for (int c = 0; c < cells; ++c) {
      worst = larger(worst, worst_of_thinned(block, c, 0));
      worst = larger(worst, worst_of_thinned(block, c, cells - 1));
    }
    for (int c = 1; c + 1 < cells; ++c) {
      worst = larger(worst, worst_of_thinned(block, 0, c));
      worst = larger(worst, worst_of_thinned(block, cells - 1, c));
    }
    for (int c = 0; c < cells; c += 2) {
      worst = worst_of_line(sample(cells, c), stride, 2 * step, 0.5 * per_step, worst);
      worst = worst_of_line(sample(c, cells), 1, 2 * step, 0.5 * per_step, worst);
    }
    return worst;
  }

  double worst_of_thinned(const ThinnedBlock& block, int column, int row) const noexcept {
    const Corners at{{kept(block, column, row), kept(block, column + 1, row),
                      kept(block, column, row + 1), kept(block, column + 1, row + 1)}};
    if (!block.splits_along_main(column, row)) return worst_of_anti(column, row, at);
    const double slope = (at[SouthEast] - at[NorthWest]) * (0.5 * per_step);
    double worst = larger(
        worst_of_main(column, row, at),
        worst_of_main_diagonal(sample(column, row), stride, 0, step, at[NorthWest], slope, 0.5));
    if (column == row && (column == 0 || column + 1 == block.cells.x)) {
      worst = larger(worst, worst_of_main(column, row, corners(column, row)));
    }
    return worst;
  }

  /// Returns the height of a point, interpolated if the point is omitted.
  double kept(const ThinnedBlock& block, int column, int row) const noexcept {
    if (!block.drops(column, row)) return point(column, row);
    return row == 0 || row == block.cells.y
               ? 0.5 * (point(column - 1, row) + point(column + 1, row))
               : 0.5 * (point(column, row - 1) + point(column, row + 1));
  }
};

/// Coarsest level whose nodes are small.
inline constexpr int last_small_level = 5;

template <int step>
Deviations regular_node_deviations(const float* corner, std::ptrdiff_t stride, int cells) noexcept {
  const RegularNode<step> node{corner, stride};
  return {node.full(cells), node.thinned(cells)};
}

/// Returns the deviations of a node of a small level. The node must have a neighbour on every side
/// and, up to level 1, all its samples, on other levels all its points. `corner` is its
/// north-western sample.
inline Deviations small_node_deviations(int level, const float* corner, std::ptrdiff_t stride,
                                        int cells) noexcept {
  switch (level) {
    case 0:
      return {0, worst_of_level_0(corner, stride, cells)};
    case 1:
      return {0.5 * worst_of_block_of_2(corner, stride, cells),
              0.25 * worst_of_borders_of_2(corner, stride, cells)};
    case 2:
      return cells == 2 ? regular_node_deviations<4>(corner, stride, 2)
                        : regular_node_deviations<4>(corner, stride, cells);
    case 3:
      return cells == 2 ? regular_node_deviations<8>(corner, stride, 2)
                        : regular_node_deviations<8>(corner, stride, cells);
    case 4:
      return regular_node_deviations<16>(corner, stride, cells);
    default:
      return regular_node_deviations<32>(corner, stride, cells);
  }
}

}  // namespace groundray::passes
