#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/error.h"
#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/fill/sorted_holes.h"

namespace groundray::data_distance_test {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;

std::vector<std::uint8_t> random_mask(glm::ivec2 size, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::bernoulli_distribution has(share);
  std::vector<std::uint8_t> mask(static_cast<std::size_t>(size.x * size.y));
  for (auto& value : mask) value = has(random) ? 1 : 0;
  return mask;
}

TEST(DataDistance, DistanceToTheNearestSampleMatchesBruteForce) {
  constexpr glm::ivec2 size(23, 31);
  constexpr double rounding = 2 * std::numeric_limits<float>::epsilon();
  for (const glm::dvec2 step_m : {glm::dvec2(1, -1), glm::dvec2(0.5, 3), glm::dvec2(-30, 20)}) {
    for (const unsigned seed : {1u, 2u, 3u, 4u}) {
      const auto mask = random_mask(size, 0.005 * seed * seed, seed);
      const auto found_m = data_distance_m(size, step_m, mask);
      for (int i = 0; i < size.x * size.y; ++i) {
        double least_m = std::numeric_limits<double>::infinity();
        for (int k = 0; k < size.x * size.y; ++k) {
          if (mask[static_cast<std::size_t>(k)] == 0) continue;
          const int columns = i % size.x - k % size.x, rows = i / size.x - k / size.x;
          least_m = std::fmin(least_m, std::hypot(columns * step_m.x, rows * step_m.y));
        }
        const double own_m = found_m[static_cast<std::size_t>(i)];
        if (std::isinf(least_m)) {
          EXPECT_EQ(own_m, least_m);
        } else {
          EXPECT_NEAR(own_m, least_m, rounding * least_m);
        }
      }
    }
  }
}

TEST(DataDistance, IsInfiniteWithoutData) {
  EXPECT_THAT(data_distance_m({3, 2}, {1, 1}, std::vector<std::uint8_t>(6)),
              Each(std::numeric_limits<float>::infinity()));
}

TEST(DataDistance, RejectsInvalidRasters) {
  const std::vector<std::uint8_t> mask(5);
  try {
    (void)data_distance_m({3, 2}, {0, 1}, mask);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("must be finite and not zero"));
    EXPECT_THAT(error.what(), HasSubstr("5 entries for 6 samples"));
  }
}

// A sample is in the hull unless a line through two samples with data has all samples with data
// strictly on its other side.
TEST(RasterHoles, HullContainsSamplesThatNoLineSeparatesFromTheData) {
  static constexpr glm::ivec2 size(9, 8);
  const auto place = [](std::size_t i) {
    return glm::ivec2(static_cast<int>(i) % size.x, static_cast<int>(i) / size.x);
  };
  const auto side = [](glm::ivec2 a, glm::ivec2 b, glm::ivec2 c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  };
  for (unsigned seed = 1; seed <= 60; ++seed) {
    auto mask = random_mask(size, 0.03 + 0.002 * seed, seed);
    mask[seed] = mask[seed + 3] = mask[(seed * 7 + 5) % mask.size()] = 1;
    std::vector<std::size_t> data;
    for (std::size_t i = 0; i < mask.size(); ++i)
      if (mask[i] != 0) data.push_back(i);
    const auto found = inside_hull(size, mask);
    for (std::size_t q = 0; q < mask.size(); ++q) {
      // q is inside if it lies in a triangle of three samples with data.
      bool is_inside = false;
      for (const std::size_t a : data)
        for (const std::size_t b : data)
          for (const std::size_t c : data) {
            const int d = side(place(a), place(b), place(q)),
                      e = side(place(b), place(c), place(q)),
                      f = side(place(c), place(a), place(q));
            const int area = side(place(a), place(b), place(c));
            if (area != 0 && ((d >= 0 && e >= 0 && f >= 0) || (d <= 0 && e <= 0 && f <= 0)))
              is_inside = true;
          }
      // Degenerate triangle: q lies on a segment between two samples.
      for (const std::size_t a : data)
        for (const std::size_t b : data) {
          const glm::ivec2 u = place(a) - place(q), v = place(b) - place(q);
          if (side(place(a), place(b), place(q)) == 0 && u.x * v.x + u.y * v.y <= 0)
            is_inside = true;
        }
      EXPECT_EQ(found[q] != 0, is_inside) << "seed " << seed << " sample " << q;
    }
  }
}

}  // namespace
}  // namespace groundray::data_distance_test
