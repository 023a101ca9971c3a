#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>

namespace groundray::passes {

/// A window of nodes cut into runs of a row: an index each.
struct NodeRuns {
  static constexpr int length = 64;
  glm::ivec2 size{0};

  struct Run {
    int row, begin, end;  ///< from the window's first node
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

/// Whether any of `count` states has any of `bits`.
inline bool any_has(const std::uint8_t* states, int count, std::uint8_t bits) noexcept {
  std::uint8_t all = 0;
  for (int i = 0; i < count; ++i) all |= states[i];
  return (all & bits) != 0;
}

}  // namespace groundray::passes
