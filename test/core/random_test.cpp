#include "core/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <tuple>

namespace groundray {
namespace {

// Known answers of philox4x32-10 published with Random123 (kat_vectors).
TEST(Random, IsPhilox) {
  EXPECT_EQ(random_bits({}),
            (std::array<std::uint32_t, 4>{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
}

TEST(Random, EveryPartOfTheKeyMatters) {
  std::set<std::array<std::uint32_t, 4>> seen;
  for (const RandomKey& key :
       {RandomKey{Seed{0}}, RandomKey{Seed{1}}, RandomKey{Seed{1ull << 40}}, RandomKey{Seed{0}, 1},
        RandomKey{Seed{0}, 0, 1}, RandomKey{Seed{0}, 0, 0, 1}, RandomKey{Seed{0}, 0, 0, 0, 1}}) {
    seen.insert(random_bits(key));
  }
  EXPECT_EQ(seen.size(), 7u);
}

// Moments of 10^6 numbers; bounds are 5 standard errors (p = 6e-7 each).
TEST(Random, NormalNumbersHaveTheirMoments) {
  constexpr int n = 500'000;
  double sum = 0, square = 0, fourth = 0, product = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    const glm::dvec2 z = random_normal({Seed{5}, 0, 0, i});
    sum += z.x + z.y;
    square += z.x * z.x + z.y * z.y;
    fourth += std::pow(z.x, 4) + std::pow(z.y, 4);
    product += z.x * z.y;
  }
  const double root = std::sqrt(2.0 * n);
  EXPECT_NEAR(sum / (2 * n), 0, 5 / root);
  EXPECT_NEAR(square / (2 * n), 1, 5 * std::sqrt(2.0) / root);
  EXPECT_NEAR(fourth / (2 * n), 3, 5 * std::sqrt(96.0) / root);
  EXPECT_NEAR(product / n, 0, 5 / std::sqrt(1.0 * n));
}

TEST(Random, UniformNumbersStayInsideTheOpenInterval) {
  for (std::uint32_t i = 0; i < 100'000; ++i) {
    const glm::dvec2 u = random_uniform({Seed{6}, 0, 0, i});
    ASSERT_TRUE(0 < u.x && u.x < 1 && 0 < u.y && u.y < 1);
  }
}

}  // namespace
}  // namespace groundray
