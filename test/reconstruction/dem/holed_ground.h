#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <limits>
#include <vector>

#include "core/geometry/grid_frame.h"
#include "terrain/relief/fractal_field.h"

// Rasters of heights with holes, for tests of filling.
namespace groundray::testing {

inline constexpr float none = std::numeric_limits<float>::quiet_NaN();

inline GridFrame frame_of(glm::ivec2 samples, glm::dvec2 step_m = {1, -1}) {
  return {.samples = samples, .origin_m = {5, 7}, .step_m = step_m, .cells_per_m = 1.0 / step_m};
}

// Row-major index of a raster's sample.
inline std::size_t index_of(int column, int row, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(column);
}

inline std::vector<float> sampled(glm::ivec2 samples,
                                  const std::function<double(int, int)>& height_m) {
  std::vector<float> heights_m;
  for (int row = 0; row < samples.y; ++row)
    for (int column = 0; column < samples.x; ++column)
      heights_m.push_back(static_cast<float>(height_m(column, row)));
  return heights_m;
}

// Heights with those where `is_gone` set to nodata.
inline std::vector<float> without(std::vector<float> heights_m, glm::ivec2 samples,
                                  const std::function<bool(int, int)>& is_gone) {
  for (int row = 0; row < samples.y; ++row)
    for (int column = 0; column < samples.x; ++column)
      if (is_gone(column, row)) heights_m[index_of(column, row, samples.x)] = none;
  return heights_m;
}

inline bool in_disc(int column, int row, int x, int y, double radius) {
  return std::hypot(column - x, row - y) <= radius;
}

inline std::vector<float> fractal_ground(int size, std::uint64_t seed) {
  const auto field =
      fractal_field({.rms_m = 8, .hurst = 0.8, .shortest_m = 2, .longest_m = 256, .seed = {seed}},
                    {size, size}, {1, 1});
  return {field.begin(), field.end()};
}

}  // namespace groundray::testing
