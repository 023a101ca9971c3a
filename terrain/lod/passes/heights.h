#pragma once

#include <algorithm>
#include <cstddef>
#include <glm/vec2.hpp>
#include <limits>

namespace groundray::passes {

/// Rectangle of heights, row by row; NaN where there is none.
struct Heights {
  const float* heights_m = nullptr;
  std::ptrdiff_t row_stride = 0;
  glm::ivec2 first{0};
  glm::ivec2 size{0};

  const float* at(int column, int row) const noexcept {
    return heights_m + (row - first.y) * row_stride + (column - first.x);
  }
};

/// Points of a level, stored densely, or as every 2^shift-th sample of the DEM and its last.
struct Points {
  Heights heights;
  int shift = 0;
  glm::ivec2 last{std::numeric_limits<int>::max()};  ///< last sample of the DEM

  double at(int column, int row) const noexcept {
    return *heights.at(std::min(column << shift, last.x), std::min(row << shift, last.y));
  }
};

}  // namespace groundray::passes
