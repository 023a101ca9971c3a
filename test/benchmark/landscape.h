#pragma once

#include "core/geometry/height_grid.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::benchmark {

/// Returns hills of 1025 x 1025 samples, 5 m apart, for single sensors.
inline const HeightGrid& hills() {
  static const HeightGrid grid = testing::fractal(1025, 5, 375, Seed{12345});
  return grid;
}

/// Returns mountains of 4097 x 4097 samples, 5 m apart: larger than the caches.
inline const HeightGrid& mountains() {
  static const HeightGrid grid = testing::fractal(4097, 5, 1500, Seed{12345});
  return grid;
}

}  // namespace groundray::benchmark
