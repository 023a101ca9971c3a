#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "reconstruction/dem/ground/ground_surface.h"

namespace groundray::disc_opening_test {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

Raster random_raster(glm::ivec2 size, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> uniform(-5, 5);
  Raster raster(size);
  for (float& value : raster.values) value = uniform(random);
  return raster;
}

// Reference: minimum over all cells whose centres are within the radius, one by one.
Raster slowly_eroded(const Raster& surface, int radius) {
  Raster result(surface.size, infinity);
  for (int y = 0; y < surface.size.y; ++y) {
    for (int x = 0; x < surface.size.x; ++x) {
      for (int v = 0; v < surface.size.y; ++v) {
        for (int u = 0; u < surface.size.x; ++u) {
          if ((u - x) * (u - x) + (v - y) * (v - y) <= radius * radius)
            result(x, y) = std::min(result(x, y), surface(u, v));
        }
      }
    }
  }
  return result;
}

Raster negated(Raster raster) {
  for (float& value : raster.values) value = -value;
  return raster;
}

TEST(DiscOpening, MatchesBruteForce) {
  for (const glm::ivec2 size : {glm::ivec2(1, 1), {1, 9}, {40, 3}, {23, 41}, {37, 70}}) {
    const Raster surface = random_raster(size, 1);
    for (const int radius : {0, 1, 2, 3, 5, 8, 13, 50}) {
      const Raster slow = negated(slowly_eroded(negated(slowly_eroded(surface, radius)), radius));
      EXPECT_EQ(opened_by_disc(surface, radius).values, slow.values) << radius;
      const Raster slow_closed =
          slowly_eroded(negated(slowly_eroded(negated(surface), radius)), radius);
      EXPECT_EQ(closed_by_disc(surface, radius).values, slow_closed.values) << radius;
    }
  }
}

TEST(DiscOpening, IsBelowTheSurfaceAndIdempotent) {
  const Raster surface = random_raster({120, 90}, 2);
  const Raster opened = opened_by_disc(surface, 4);
  EXPECT_TRUE(std::ranges::equal(opened.values, surface.values, std::less_equal<>()));
  EXPECT_EQ(opened_by_disc(opened, 4).values, opened.values);
}

TEST(DiscOpening, KeepsShapesThatContainTheDisc) {
  Raster surface(glm::ivec2(60, 60), 0);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 60; ++x) {
      if ((x - 20) * (x - 20) + (y - 20) * (y - 20) <= 49) surface(x, y) = 3;
      if (std::abs(x - 45) <= 3) surface(x, y) = 5;
    }
  }
  const Raster opened = opened_by_disc(surface, 7);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 60; ++x) EXPECT_EQ(opened(x, y), std::abs(x - 45) <= 3 ? 0 : surface(x, y));
  }
}

}  // namespace
}  // namespace groundray::disc_opening_test
