#pragma once

// Private to the library: numbers per cell, for the ground filter.
#include <algorithm>
#include <cstddef>
#include <glm/vec2.hpp>
#include <limits>
#include <vector>

namespace groundray {

/// Numbers of the cells of a rectangle, in row order; NaN for none.
struct Raster {
  glm::ivec2 size{0};  ///< columns and rows
  std::vector<float> values;

  Raster() = default;
  explicit Raster(glm::ivec2 cells, float value = std::numeric_limits<float>::quiet_NaN())
      : size(cells),
        values(static_cast<std::size_t>(cells.x) * static_cast<std::size_t>(cells.y), value) {}

  std::size_t index(int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(size.x) +
           static_cast<std::size_t>(column);
  }
  float operator()(int column, int row) const noexcept { return values[index(column, row)]; }
  float& operator()(int column, int row) noexcept { return values[index(column, row)]; }
  const float* row(int row) const noexcept { return values.data() + index(0, row); }
  float* row(int row) noexcept { return values.data() + index(0, row); }
};

/// Returns the bilinear interpolation between the four cell centres around a position, in cells
/// from the first cell's centre; outside, that at the nearest position on the border.
inline float between_cells(const Raster& raster, float x, float y) noexcept {
  const int last_column = raster.size.x - 1, last_row = raster.size.y - 1;
  x = std::clamp(x, 0.f, static_cast<float>(last_column));
  y = std::clamp(y, 0.f, static_cast<float>(last_row));
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const int next = std::min(column + 1, last_column);
  const float *low = raster.row(row), *high = raster.row(std::min(row + 1, last_row));
  const float u = x - static_cast<float>(column), v = y - static_cast<float>(row);
  const float below = low[column] + u * (low[next] - low[column]);
  return below + v * (high[column] + u * (high[next] - high[column]) - below);
}

}  // namespace groundray
