#include "core/sobol.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace groundray::sobol_test {
namespace {

glm::dvec2 pair_of(std::uint32_t seed, std::uint32_t index, int pair) {
  SobolPairs numbers(seed, index);
  glm::dvec2 point = numbers.next();
  for (int k = 0; k < pair; ++k) point = numbers.next();
  return point;
}

// The first 2^m points, and any later 2^m of an aligned range.
TEST(SobolPairs, PointsStratifyEveryElementaryInterval) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    for (int pair = 0; pair < 4; ++pair) {
      for (int m = 1; m <= 10; ++m) {
        const std::uint32_t count = 1u << m;
        for (int a = 0; a <= m; ++a) {
          std::set<std::pair<int, int>> taken;
          for (std::uint32_t i = 0; i < count; ++i) {
            const glm::dvec2 p = pair_of(7919 * seed, (seed - 1) * count + i, pair);
            taken.emplace(static_cast<int>(std::ldexp(p.x, a)),
                          static_cast<int>(std::ldexp(p.y, m - a)));
          }
          ASSERT_EQ(taken.size(), count) << "seed " << seed << ", pair " << pair << ", " << a;
        }
      }
    }
  }
}

// The means of single sequences must be unbiased over seeds, and pairs must be independent: sums
// over 20,000 seeds of products of uniform numbers minus their mean are normal; the bound is 5
// standard errors.
TEST(SobolPairs, AreUniformAndIndependentAcrossSeedsAndPairs) {
  constexpr int seeds = 20'000;
  double mean = 0, product_of_axes = 0, product_of_pairs = 0, product_of_seeds = 0;
  glm::dvec2 before(0);
  for (std::uint32_t seed = 0; seed < seeds; ++seed) {
    const glm::dvec2 a = pair_of(seed, 3, 0) - 0.5, b = pair_of(seed, 3, 1) - 0.5;
    mean += a.x;
    product_of_axes += a.x * a.y;
    product_of_pairs += a.x * b.x;
    product_of_seeds += a.x * before.x;
    before = a;
  }
  const double n = seeds;
  EXPECT_LT(std::abs(mean), 5 * std::sqrt(n / 12));
  for (const double sum : {product_of_axes, product_of_pairs, product_of_seeds})
    EXPECT_LT(std::abs(sum), 5 * std::sqrt(n) / 12);
}

// The variance of the mean of a smooth function falls with n^-3 for a scrambled net, with 1/n for
// random numbers.
TEST(SobolPairs, IntegrateSmoothFunctionsMoreAccuratelyThanRandomNumbers) {
  const auto error_of = [](std::uint32_t count) {
    double squares = 0;
    for (std::uint32_t seed = 0; seed < 200; ++seed) {
      double sum = 0;
      for (std::uint32_t i = 0; i < count; ++i) {
        const glm::dvec2 p = pair_of(seed, i, 1);
        sum += std::exp(p.x + p.y);
      }
      const double exact = (std::exp(1.0) - 1) * (std::exp(1.0) - 1);
      squares += (sum / count - exact) * (sum / count - exact);
    }
    return std::sqrt(squares / 200);
  };
  EXPECT_LT(error_of(1024), error_of(16) / 200);  // 64^1.5 = 512, less logarithmic factors
}

TEST(SobolPairs, PacksHaveTheBitsOfSingleSequences) {
  const auto seed = [](auto lane) { return std::uint32_t{lane} * 7919 + 3; };
  const auto index = [](auto lane) { return std::uint32_t{lane} * 12345; };
  SobolPairsOf<PackOfWords> all{PackOfWords(seed), PackOfWords(index)};
  for (std::uint32_t pair = 0; pair < 1000; ++pair) {
    const Vec2<Pack> found = all.next();
    for (std::uint32_t lane = 0; lane < pack_size; ++lane) {
      const glm::dvec2 expected = SobolPairs(seed(lane), index(lane), pair).next();
      ASSERT_EQ(glm::dvec2(found.x[lane], found.y[lane]), expected) << pair;
    }
  }
}

}  // namespace
}  // namespace groundray::sobol_test
