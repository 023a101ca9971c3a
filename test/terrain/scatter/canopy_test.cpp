#include "terrain/scatter/canopy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/random.h"

namespace groundray::canopy_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::size_t plenty = std::size_t{1} << 30;

double share_at(const Drape& canopy, glm::dvec2 p) {
  return static_cast<double>(canopy.image.color(canopy.uv_at(p)).r);
}

// Area common to two discs whose centres are `apart_m` from each other.
double lens_m2(double r, double s, double apart_m) {
  if (apart_m >= r + s) return 0;
  if (apart_m <= std::abs(r - s)) return std::numbers::pi * std::pow(std::min(r, s), 2);
  const double a = std::acos((apart_m * apart_m + r * r - s * s) / (2 * apart_m * r));
  const double b = std::acos((apart_m * apart_m + s * s - r * r) / (2 * apart_m * s));
  return r * r * (a - std::sin(2 * a) / 2) + s * s * (b - std::sin(2 * b) / 2);
}

TEST(Canopy, ShareOfOneCrownIsTheLensOfTwoDiscs) {
  const std::vector<Crown> crowns{{{31.37, 24.81}, 6.2}};
  const Drape canopy = canopy_cover(crowns, {{0, 0}, {60, 50}}, 0.1, 4, plenty);
  for (double x_m = 31.35; x_m < 45; x_m += 0.5) {
    const double apart_m = glm::distance(glm::dvec2(x_m, 24.85), crowns[0].centre_m);
    const double expected = lens_m2(6.2, 4, apart_m) / (16 * std::numbers::pi);
    // Pixels of 0.1 m along an outline of 8 m: 1 % of a disc of 4 m.
    EXPECT_NEAR(share_at(canopy, {x_m, 24.85}), expected, 0.01) << apart_m;
  }
}

TEST(Canopy, OverlappingCrownsCountOnceAndTheEdgeIsNoClearing) {
  const std::vector<Crown> crowns{{{0, 0}, 9}, {{1, 0}, 9}, {{0, 1}, 9}};
  const Drape canopy = canopy_cover(crowns, {{0, 0}, {40, 30}}, 0.5, 2, plenty);
  EXPECT_EQ(share_at(canopy, {0.25, 0.25}), 1);
  EXPECT_EQ(share_at(canopy, {30.25, 20.25}), 0);
}

// Every pixel against a count of the pixels around it, crown by crown.
TEST(Canopy, EqualsACountOfPixels) {
  std::vector<Crown> crowns;
  for (std::uint32_t i = 0; i < 25; ++i) {
    const glm::dvec2 u = random_uniform({.seed = {8}, .pulse = i});
    const glm::dvec2 v = random_uniform({.seed = {9}, .pulse = i});
    crowns.push_back({u * glm::dvec2(44, 34) - 2.0, 0.3 + 4 * v.x});
  }
  constexpr double cell_m = 0.5, radius_m = 1.8;
  const Drape canopy = canopy_cover(crowns, {{0, 0}, {40, 30}}, cell_m, radius_m, plenty);
  const glm::ivec2 size(80, 60);
  ASSERT_EQ(canopy.image.size(), size);
  const auto centre = [](int x, int y) { return (glm::dvec2(x, y) + 0.5) * cell_m; };
  std::vector<char> is_below;
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      is_below.push_back(std::ranges::any_of(crowns, [&](const Crown& crown) {
        return glm::distance(centre(x, y), crown.centre_m) <= crown.radius_m;
      }));
    }
  }
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      double below = 0, all = 0;
      for (int row = 0; row < size.y; ++row) {
        for (int column = 0; column < size.x; ++column) {
          if (std::hypot(row - y, column - x) * cell_m > radius_m) continue;
          below += is_below[static_cast<std::size_t>(row) * static_cast<std::size_t>(size.x) +
                            static_cast<std::size_t>(column)];
          ++all;
        }
      }
      ASSERT_FLOAT_EQ(canopy.image.texel(0, x, size.y - 1 - y).r, static_cast<float>(below / all))
          << x << " " << y;
    }
  }
}

TEST(Canopy, RefusesWhatExceedsTheMemory) {
  EXPECT_THAT(
      [] {
        canopy_cover({}, {{0, 0}, {1000, 1000}}, 0.1, 2, std::size_t{1} << 20);
      },
      ThrowsMessage<Error>(HasSubstr("canopy: a grid of 10000 x 10000 cells takes")));
}

TEST(Canopy, RefusesANeighbourhoodOfTooManyCells) {
  EXPECT_THAT(
      [] {
        canopy_cover({}, {{0, 0}, {100, 100}}, 0.1, 30, std::size_t{1} << 30);
      },
      ThrowsMessage<Error>(HasSubstr("canopy: radius_m = 30 is more than 256 cells")));
}

}  // namespace
}  // namespace groundray::canopy_test
