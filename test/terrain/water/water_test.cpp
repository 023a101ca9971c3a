#include "terrain/water/water.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/random.h"

namespace groundray::water_test {
namespace {

// Index of a sample in rows of `columns`.
std::size_t index_of(int column, int row, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(column);
}

HeightGrid grid_of(glm::ivec2 size, double step_m, auto height_m) {
  std::vector<float> heights;
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column)
      heights.push_back(static_cast<float>(height_m(column, row)));
  }
  return HeightGrid(size, {0, 0}, {step_m, -step_m}, heights);
}

// Water stands as high as the lowest of the highest points of all ways out, found by relaxation.
TEST(StandingWater, FillsDepressionsToTheirLowestOutlet) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    constexpr int side = 24;
    const HeightGrid ground = grid_of({side, side}, 1, [&](int column, int row) {
      const RandomKey key{Seed{seed}, 0, 0, static_cast<std::uint32_t>(row * side + column)};
      const glm::dvec2 random = random_uniform(key);
      return random.y < 0.03 ? std::nan("") : std::floor(8 * random.x) / 4;
    });
    const auto height_m = [&](int column, int row) {
      const bool is_inside = column >= 0 && row >= 0 && column < side && row < side;
      return is_inside ? double{ground.height_m(column, row)} : std::nan("");
    };
    std::vector<double> level(std::size_t{side} * side, 1e9);
    for (bool has_changed = true; has_changed;) {
      has_changed = false;
      for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
          if (std::isnan(height_m(column, row))) continue;
          double lowest = 1e9;
          for (int y = row - 1; y <= row + 1; ++y) {
            for (int x = column - 1; x <= column + 1; ++x) {
              if (x == column && y == row) continue;
              lowest =
                  std::min(lowest, std::isnan(height_m(x, y)) ? -1e9 : level[index_of(x, y, side)]);
            }
          }
          const double now = std::max(height_m(column, row), lowest);
          double& before = level[index_of(column, row, side)];
          if (now < before) {
            before = now;
            has_changed = true;
          }
        }
      }
    }
    const StandingWater water = standing_water(ground, 100);
    for (int i = 0; i < side * side; ++i) {
      const double z_m = height_m(i % side, i / side);
      const float depth_m = water.depth_m[static_cast<std::size_t>(i)];
      ASSERT_EQ(std::isnan(depth_m), std::isnan(z_m));
      if (std::isnan(z_m)) continue;
      ASSERT_EQ(depth_m, level[static_cast<std::size_t>(i)] - z_m) << i;
    }
  }
}

// On a plane, the area above a sample is a strip up to the border: a = distance, b = slope.
TEST(StandingWater, IndexOfAPlaneFollowsFromTheDistanceToItsTop) {
  constexpr double step_m = 2, slope = 0.25;
  const HeightGrid ground =
      grid_of({201, 61}, step_m, [&](int /*column*/, int row) { return -slope * step_m * row; });
  const StandingWater water = standing_water(ground, 100);
  for (int row = 1; row < 60; ++row) {
    const std::size_t i = index_of(100, row, 201);
    ASSERT_EQ(water.depth_m[i], 0);
    // The uppermost row is a border, from which water leaves at once.
    ASSERT_NEAR(water.wetness[i], std::log(row * step_m / slope), 1e-6) << row;
  }
}

// On a cone, the area above a contour of radius r is a disc: a = pi r^2 / (2 pi r) = r / 2. Sharing
// it among eight directions leaves 6 % too much on average, as the central pixels do.
TEST(StandingWater, IndexOfAConeIsThatOfHalfItsRadius) {
  constexpr int half = 100;
  constexpr double slope = 0.5;
  const HeightGrid ground = grid_of({2 * half + 1, 2 * half + 1}, 1, [&](int column, int row) {
    return -slope * std::hypot(column - half, row - half);
  });
  const StandingWater water = standing_water(ground, 100);
  double sum = 0, squares = 0;
  int count = 0;
  for (int row = 1; row < 2 * half; ++row) {
    for (int column = 1; column < 2 * half; ++column) {
      const double radius_m = std::hypot(column - half, row - half);
      if (radius_m < 20 || radius_m > 95) continue;
      const double off =
          water.wetness[index_of(column, row, 2 * half + 1)] - std::log(radius_m / 2 / slope);
      sum += off;
      squares += off * off;
      ++count;
    }
  }
  EXPECT_NEAR(sum / count, 0, 0.07);
  EXPECT_LT(std::sqrt(squares / count), 0.15);
}

// Two bowls of parabolic section, one in the side of the other.
TEST(StandingWater, SeepsAwayFromDeepDepressions) {
  const HeightGrid ground = grid_of({101, 101}, 1, [](int column, int row) {
    const double deep = std::min(0.0, std::hypot(column - 50, row - 50) / 20 - 2);
    const double shallow = std::min(0.0, std::hypot(column - 65, row - 50) / 8 - 0.5);
    return deep + shallow;
  });
  const std::size_t middle = index_of(50, 50, 101), side = index_of(65, 50, 101);
  const StandingWater full = standing_water(ground, 3);
  EXPECT_NEAR(full.depth_m[middle], 2, 1e-6);
  EXPECT_NEAR(full.depth_m[side], 0.75 + 1 - 0.25 + 0.25, 0.3);
  const StandingWater drained = standing_water(ground, 1);
  EXPECT_EQ(drained.depth_m[middle], 0);
  // What remains in the side is up to the rim towards the middle, 4 m inwards: 0.2 m lower.
  EXPECT_NEAR(drained.depth_m[side], 0.5 - 4.0 / 20, 0.02);
}

TEST(StandingWater, NoPoolOfRoughGroundIsDeeperThanTheLimit) {
  constexpr int side = 80;
  const HeightGrid ground = grid_of({side, side}, 1, [](int column, int row) {
    return random_uniform({Seed{7}, 0, 0, static_cast<std::uint32_t>(row * side + column)}).x;
  });
  const auto deepest_m = [&](double most_m) {
    return std::ranges::max(standing_water(ground, most_m).depth_m);
  };
  EXPECT_GT(deepest_m(1), 0.5);
  for (const double most_m : {0.0, 0.1, 0.25, 0.4}) {
    EXPECT_LE(deepest_m(most_m), most_m);
    EXPECT_GE(deepest_m(most_m), 0.95 * most_m);
  }
}

}  // namespace
}  // namespace groundray::water_test
