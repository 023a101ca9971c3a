#pragma once

// Private to erosion: where water flows.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace groundray {

/// Samples of a grid, row by row, with up to eight neighbours each.
struct SampleGrid {
  glm::ivec2 size{0};
  glm::dvec2 step_m{1};  ///< positive

  std::size_t count() const {
    return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
  }
  /// Returns the index of the block of 2 x 2 samples that a sample is in.
  std::size_t block(std::size_t at) const {
    const auto columns = static_cast<std::size_t>(size.x);
    return at / columns / 2 * ((columns + 1) / 2) + at % columns / 2;
  }
  /// Calls `act(neighbour, distance_m)` for each neighbour of a sample.
  template <typename Act>
  void each_neighbour(std::size_t at, const Act& act) const {
    constexpr std::array<glm::ivec2, 8> moves{
        {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};
    const auto columns = static_cast<std::size_t>(size.x);
    const glm::ivec2 place(at % columns, at / columns);
    for (const glm::ivec2 move : moves) {
      const glm::ivec2 to = place + move;
      if (to.x < 0 || to.y < 0 || to.x >= size.x || to.y >= size.y) continue;
      const glm::dvec2 move_m = glm::dvec2(move) * step_m;
      act(static_cast<std::size_t>(to.y) * columns + static_cast<std::size_t>(to.x),
          std::sqrt(move_m.x * move_m.x + move_m.y * move_m.y));
    }
  }
};

/// Tree of the samples' receivers: each sample drains to its steepest lower neighbour or, in a
/// depression, towards the outlet of the depression.
struct FlowTree {
  std::vector<std::uint32_t> order;      ///< samples with heights, receivers first
  std::vector<std::uint32_t> receivers;  ///< by sample; outlets are their own
  std::vector<double> distances_m;       ///< from each sample to its receiver

  /// Returns the area that drains through each sample, itself included.
  std::vector<double> areas_m2(double sample_m2) const;
};

/// Returns the flow over heights; NaN where there are none. Water leaves at the border and beside
/// missing heights. Depressions are filled by priority-flood.
/// @see Barnes, Lehman, Mulla, Computers & Geosciences 62 (2014), 117-127.
FlowTree flow_tree(const SampleGrid& grid, std::span<const double> heights_m);

}  // namespace groundray
