#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>

namespace groundray::passes {

/// Window of nodes, divided into runs within rows; each run is one index of a pass.
struct NodeRuns {
  static constexpr int length = 64;
  glm::ivec2 size{0};

  struct Run {
    int row, begin, end;  ///< relative to the window's first node
  };
  std::size_t in_row() const noexcept {
    return static_cast<std::size_t>((size.x + length - 1) / length);
  }
  std::size_t count() const noexcept { return in_row() * static_cast<std::size_t>(size.y); }
  Run at(std::size_t index) const noexcept {
    const int begin = static_cast<int>(index % in_row()) * length;
    return {static_cast<int>(index / in_row()), begin, std::min(begin + length, size.x)};
  }
};

/// Returns whether any of `count` states has any of `bits`.
inline bool any_has(const std::uint8_t* states, int count, std::uint8_t bits) noexcept {
  std::uint8_t all = 0;
  for (int i = 0; i < count; ++i) all |= states[i];
  return (all & bits) != 0;
}

}  // namespace groundray::passes
