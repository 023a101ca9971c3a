#pragma once

#include <cmath>
#include <cstddef>

#include "terrain/lod/passes/cell_plane.h"
#include "terrain/lod/passes/node_arrays.h"

namespace groundray::passes {

// The two finest levels have the most nodes. Their templates can differ from the reference surface
// only at few positions per node, which are written out here, for nodes that have a neighbour on
// every side and no holes. Positions are given by steps from a sample along a side and inwards. One
// code thus serves all four sides, from each of which the triangulation looks the same.

/// Returns twice the distance between c and the mean of a and b.
inline double twice_off_middle(double a, double b, double c) noexcept {
  return std::abs(a + b - 2 * c);
}

/// Returns twice the largest deviation of a pair of cells of level 0 on a thinned side, but at
/// least `worst`; `outer` is the first sample on the side.
inline double worst_of_fine_pair(const float* outer, std::ptrdiff_t along, std::ptrdiff_t inward,
                                 double worst) noexcept {
  const double first = outer[0];
  const double dropped = outer[along];
  worst = larger(worst, twice_off_middle(first, outer[2 * along], dropped));
  return larger(worst, std::abs(first + outer[along + inward] - (dropped + outer[inward])));
}

/// Returns the largest deviation of the templates of a node of level 0, metres.
inline double worst_of_level_0(const float* corner, std::ptrdiff_t stride,
                               std::ptrdiff_t cells) noexcept {
  const float* last = corner + cells * (stride + 1);
  double worst = 0;
  for (std::ptrdiff_t c = 0; c < cells; c += 2) {
    worst = worst_of_fine_pair(corner + c, 1, stride, worst);
    worst = worst_of_fine_pair(corner + c * stride, stride, 1, worst);
    worst = worst_of_fine_pair(last - c, -1, -stride, worst);
    worst = worst_of_fine_pair(last - c * stride, -stride, -1, worst);
  }
  return 0.5 * worst;
}

/// Returns twice the largest deviation of the halves of a cell of level 1, except on its eastern
/// and southern sides, but at least `worst`.
inline double worst_of_cell_of_2(const float* corner, std::ptrdiff_t stride,
                                 double worst) noexcept {
  const double north_west = corner[0];
  const double north_east = corner[2];
  const double south_west = corner[2 * stride];
  worst = larger(worst, twice_off_middle(north_west, north_east, corner[1]));
  worst = larger(worst, twice_off_middle(north_west, south_west, corner[stride]));
  return larger(worst, twice_off_middle(north_east, south_west, corner[stride + 1]));
}

/// Returns twice the largest deviation of the unthinned block of level 1.
inline double worst_of_block_of_2(const float* corner, std::ptrdiff_t stride,
                                  std::ptrdiff_t cells) noexcept {
  double worst = 0;
  for (std::ptrdiff_t row = 0; row < cells; ++row) {
    for (std::ptrdiff_t column = 0; column < cells; ++column) {
      worst = worst_of_cell_of_2(corner + 2 * (row * stride + column), stride, worst);
    }
  }
  const float* south = corner + 2 * cells * stride;
  const float* east = corner + 2 * cells;
  for (std::ptrdiff_t c = 0; c < 2 * cells; c += 2) {
    worst = larger(worst, twice_off_middle(south[c], south[c + 2], south[c + 1]));
    const float* at = east + c * stride;
    worst = larger(worst, twice_off_middle(at[0], at[2 * stride], at[stride]));
  }
  return worst;
}

/// Returns 4 times the largest deviation of a pair of cells of level 1 on a thinned side, but at
/// least `worst`.
inline double worst_of_pair_of_2(const float* outer, std::ptrdiff_t along, std::ptrdiff_t inward,
                                 double worst) noexcept {
  const double first = outer[0];
  const double second = outer[4 * along];
  const double inner = outer[2 * (along + inward)];
  const float* middle = outer + along + inward;
  worst = larger(worst, std::abs(3 * first + second - 4.0 * outer[along]));
  worst = larger(worst, 2 * twice_off_middle(first, second, outer[2 * along]));
  worst = larger(worst, std::abs(first + 3 * second - 4.0 * outer[3 * along]));
  worst = larger(worst, std::abs(first + second + 2 * inner - 4.0 * middle[along]));
  worst = larger(worst, 2 * twice_off_middle(first, inner, *middle));
  const double nearer = static_cast<double>(outer[along]) + outer[inward];
  const double farther = static_cast<double>(middle[along]) + middle[inward];
  worst = larger(worst, std::abs(3 * first + inner - 2 * nearer));
  return larger(worst, std::abs(first + 3 * inner - 2 * farther));
}

/// Returns 4 times the largest deviation of the thinned sides of a node of level 1.
inline double worst_of_borders_of_2(const float* corner, std::ptrdiff_t stride,
                                    std::ptrdiff_t cells) noexcept {
  const float* last = corner + 2 * cells * (stride + 1);
  double worst = 0;
  for (std::ptrdiff_t c = 0; c < 2 * cells; c += 4) {
    worst = worst_of_pair_of_2(corner + c, 1, stride, worst);
    worst = worst_of_pair_of_2(corner + c * stride, stride, 1, worst);
    worst = worst_of_pair_of_2(last - c, -1, -stride, worst);
    worst = worst_of_pair_of_2(last - c * stride, -stride, -1, worst);
  }
  return worst;
}

/// Run of nodes of 2 x 2 cells in a row, without holes and with a neighbour on every side.
struct FineRun {
  const float* corner;  ///< north-western sample of the first node
  std::ptrdiff_t stride;
  std::ptrdiff_t count;
  NodeArrays nodes;
  std::size_t out;  ///< index of the first node in the arrays

  void add_level_0() const noexcept {
    float* const key = nodes.key_m + out;
#pragma omp simd
    for (std::ptrdiff_t i = 0; i < count; ++i) {
      key[i] = rounded_up(worst_of_level_0(corner + 2 * i, stride, 2));
    }
    if (nodes.deviation_m == nullptr) return;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
      const std::size_t at = out + static_cast<std::size_t>(i);
      nodes.deviation_m[at] = key[i];
      for (std::ptrdiff_t sample = 0; sample < 9; ++sample) {
        const float height = corner[2 * i + sample % 3 + sample / 3 * stride];
        nodes.low_m[at] = height < nodes.low_m[at] ? height : nodes.low_m[at];
        nodes.high_m[at] = height > nodes.high_m[at] ? height : nodes.high_m[at];
      }
    }
  }

  void add_level_1() const noexcept {
    float* const key = nodes.key_m + out;
#pragma omp simd
    for (std::ptrdiff_t i = 0; i < count; ++i) {
      const double full = 0.5 * worst_of_block_of_2(corner + 4 * i, stride, 2);
      const double thinned = 0.25 * worst_of_borders_of_2(corner + 4 * i, stride, 2);
      key[i] = rounded_up(larger(full, thinned));
    }
    if (nodes.deviation_m == nullptr) return;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
      const std::size_t at = out + static_cast<std::size_t>(i);
      nodes.deviation_m[at] = key[i];
      nodes.full_m[at] = rounded_up(0.5 * worst_of_block_of_2(corner + 4 * i, stride, 2));
    }
  }
};

}  // namespace groundray::passes
