#include "terrain/water/water_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace groundray::water_distance_test {
namespace {

StandingWater water_of(glm::ivec2 size, glm::dvec2 step_m, std::vector<float> depth_m) {
  const GridFrame frame{size, {3, 5}, step_m, 1.0 / step_m};
  return {.frame = frame, .depth_m = std::move(depth_m), .wetness = {}};
}

// Every sample against every wet one.
TEST(WaterDistance, IsThatOfTheNearestWetSample) {
  constexpr int columns = 37, rows = 23;
  constexpr double east_m = 0.5, north_m = 0.8;
  std::mt19937 random(3);
  for (const double share : {0.003, 0.05, 0.6}) {
    std::bernoulli_distribution is_wet(share);
    std::vector<float> depth_m(std::size_t{columns} * rows);
    for (float& depth : depth_m) depth = is_wet(random) ? 0.3f : 0.01f;
    depth_m[100] = std::numeric_limits<float>::quiet_NaN();
    depth_m[200] = 0.1f;  // exactly the least depth
    const StandingWater water = water_of({columns, rows}, {east_m, -north_m}, depth_m);
    const std::vector<float> found = distance_to_water_m(water, 0.1f);
    const auto place_m = [](std::size_t at) {
      const std::size_t row = at / columns;
      return glm::dvec2(static_cast<double>(at % columns) * east_m,
                        static_cast<double>(row) * north_m);
    };
    for (std::size_t at = 0; at < depth_m.size(); ++at) {
      double nearest_m = std::numeric_limits<double>::infinity();
      for (std::size_t other = 0; other < depth_m.size(); ++other) {
        if (depth_m[other] >= 0.1f)
          nearest_m = std::min(nearest_m, glm::distance(place_m(at), place_m(other)));
      }
      ASSERT_FLOAT_EQ(found[at], static_cast<float>(nearest_m)) << at;
    }
  }
}

TEST(WaterDistance, IsInfiniteWithoutWater) {
  const StandingWater dry = water_of({4, 3}, {1, -1}, std::vector<float>(12, 0.f));
  for (const float distance_m : distance_to_water_m(dry, 0.02)) EXPECT_TRUE(std::isinf(distance_m));
}

}  // namespace
}  // namespace groundray::water_distance_test
