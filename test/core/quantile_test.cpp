#include "core/quantile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace groundray::quantile_test {
namespace {

// Oracle by counting: enough values do not exceed the quantile, and too few do not exceed the next
// smaller value.
TEST(Quantile, IsTheSmallestValueThatCoversTheFraction) {
  std::mt19937 random(3);
  for (int count = 1; count <= 400; ++count) {
    std::vector<double> values(static_cast<std::size_t>(count));
    std::iota(values.begin(), values.end(), 1);
    std::ranges::shuffle(values, random);
    for (const int percent : {5, 50, 95, 100}) {
      const double found = quantile(values, 0.01 * percent);
      EXPECT_GE(100 * std::lround(found), percent * count) << percent << " % of " << count;
      EXPECT_LT(100 * (std::lround(found) - 1), percent * count) << percent << " % of " << count;
    }
  }
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(Quantile, MedianOfAnEvenCountIsTheMeanOfTheMiddleTwo) {
  EXPECT_EQ(median({3}), 3);
  EXPECT_EQ(median({4, 1}), 2.5);
  EXPECT_EQ(median({9, 1, 4}), 4);
  EXPECT_EQ(median({9, 1, 4, 6}), 5);
  EXPECT_TRUE(std::isnan(median({})));
}

TEST(Quantile, NmadIsTheScaledMedianDistanceToTheMedian) {
  EXPECT_DOUBLE_EQ(nmad({1, 2, 4, 8, 100}), 1.4826 * 3);  // median of 3, 2, 0, 4 and 96
  EXPECT_TRUE(std::isnan(nmad({})));
}

}  // namespace
}  // namespace groundray::quantile_test
