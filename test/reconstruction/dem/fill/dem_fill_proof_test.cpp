#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <optional>
#include <random>
#include <vector>

#include "reconstruction/dem/fill/dem_fill.h"
#include "test/reconstruction/dem/holed_ground.h"
#include "test/support/machine_speed.h"
#include "test/support/margin.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::dem_fill_proof_test {
namespace {

using testing::fractal_ground;
using testing::frame_of;
using testing::in_disc;
using testing::index_of;
using testing::none;
using testing::without;

// Expects that the holes of a square raster are filled at 100 000 samples per second of CPU time or
// faster. Returns the number of filled samples.
std::size_t expect_swift(const std::vector<float>& holed_m, const std::vector<float>& most_m,
                         int side, const char* what, std::optional<ThinPlateEnergy> form = {}) {
  const std::clock_t begin = std::clock();
  const FilledHeights filled = fill_dem(frame_of({side, side}), holed_m, most_m,
                                        {.farthest_m = 1000, .largest_share = 1, .form = form});
  const double cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  const double most_s =
      testing::slowness() * std::max(1.0, static_cast<double>(filled.filled) / 1e5);
  EXPECT_LE(cpu_s, most_s);
  testing::record_margin(what, cpu_s, most_s, "s");
  return filled.filled;
}

TEST(DemFillProof, Fills100000SamplesWithinASecond) {
  const int side = static_cast<int>(testing::proof_size(256, 1024));
  const std::size_t most = testing::proof_size(10'000, 100'000);
  auto holed_m = fractal_ground(side, 6);
  std::mt19937 random(6);
  std::size_t hidden = 0;
  while (hidden < most) {
    const int x = 24 + static_cast<int>(random() % static_cast<unsigned>(side - 48)),
              y = 24 + static_cast<int>(random() % static_cast<unsigned>(side - 48));
    const double radius = 1 + static_cast<double>(random() % 200) / 10;
    for (int row = y - 20; row <= y + 20; ++row) {
      for (int column = x - 20; column <= x + 20; ++column) {
        float& z = holed_m[index_of(column, row, side)];
        if (!in_disc(column, row, x, y, radius) || std::isnan(z)) continue;
        z = none;
        ++hidden;
      }
    }
  }
  EXPECT_EQ(expect_swift(holed_m, {}, side, "CPU time of filling 100 000 samples"), hidden);
}

TEST(DemFillProof, FillsOneHoleOf100000SamplesWithinASecond) {
  const int side = static_cast<int>(testing::proof_size(128, 512)), wide = side * 317 / 512;
  const auto holed_m = without(fractal_ground(side, 6), {side, side}, [&](int c, int r) {
    return 32 <= c && c < 32 + wide && 32 <= r && r < 32 + wide;
  });
  const auto samples = static_cast<std::size_t>(wide) * static_cast<std::size_t>(wide);
  for (const ThinPlateEnergy form : {ThinPlateEnergy{0, 0}, ThinPlateEnergy{0, 5}}) {
    EXPECT_EQ(expect_swift(holed_m, {}, side, "CPU time of filling one hole", form), samples);
  }
}

TEST(DemFillProof, Fills100000SamplesUnderBoundsWithinASecond) {
  const int side = static_cast<int>(testing::proof_size(128, 1024));
  auto holed_m = fractal_ground(side, 6);
  std::vector<float> most_m(holed_m.size(), none);
  for (int r = 0; r < side; ++r) {
    float line_m = -1000;  // height of the ray of light along the row
    for (int c = 0; c < side; ++c) {
      float& z = holed_m[index_of(c, r, side)];
      const float next_m = std::max(line_m, z) - 0.6f;
      if (line_m > z) {
        most_m[index_of(c, r, side)] = line_m;
        z = none;
      }
      line_m = next_m;
    }
  }
  EXPECT_GT(expect_swift(holed_m, most_m, side, "CPU time of filling under bounds"), 500u);
}

}  // namespace
}  // namespace groundray::dem_fill_proof_test
