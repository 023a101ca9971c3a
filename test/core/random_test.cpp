#include "core/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <tuple>

namespace groundray::random_test {
namespace {

// Known answers of philox4x32-10 published with Random123 (kat_vectors).
TEST(Random, MatchesPhilox) {
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

// Pearson's chi-squared test against the probabilities, in bins of at least 10 expected counts; the
// statistic must stay below its mean plus 5 standard deviations (p = 3e-6 and less).
TEST(RandomPoisson, MatchesPoissonProbabilities) {
  for (const double mean : {0.01, 0.7, 3.0, 9.99, 10.0, 35.0, 400.0}) {
    constexpr int draws = 100'000;
    std::map<int, int> counts;
    for (std::uint32_t i = 0; i < draws; ++i)
      ++counts[static_cast<int>(random_poisson({.seed = Seed{5}, .pulse = i}, mean))];
    double chi2 = 0, expected = 0;
    int bins = 0, seen = 0;
    double left = draws;
    for (int k = 0; left > 10; ++k) {
      const double here = draws * std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0));
      expected += here;
      left -= here;
      seen += counts[k];
      if (expected < 10) continue;
      chi2 += (seen - expected) * (seen - expected) / expected;
      ++bins;
      expected = 0;
      seen = 0;
    }
    EXPECT_LT(chi2, bins + 5 * std::sqrt(2.0 * bins) + 5) << mean;
  }
}

TEST(RandomPoisson, HasTheCorrectMeanAndVarianceAtLargeMeans) {
  for (const double mean : {1e4, 1e7}) {
    constexpr int draws = 20'000;
    double sum = 0, squares = 0;
    for (std::uint32_t i = 0; i < draws; ++i) {
      const double off = random_poisson({.seed = Seed{6}, .pulse = i}, mean) - mean;
      sum += off;
      squares += off * off;
    }
    EXPECT_LT(std::abs(sum), 5 * std::sqrt(draws * mean));
    EXPECT_NEAR(squares / draws, mean, 5 * mean * std::sqrt(2.0 / draws));
  }
  EXPECT_EQ(random_poisson({.seed = Seed{1}}, 0), 0);
}

}  // namespace
}  // namespace groundray::random_test
