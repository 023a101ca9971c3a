#include "sensors/lidar/receiver/normal_spread.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "test/support/margin.h"

namespace groundray::normal_spread_test {
namespace {

using std::numbers::pi;

// Standard deviation of value(z) over z > least: the midpoint rule with 400,000 steps, over ten
// standard deviations.
double summed_deviation(double least, const std::function<double(double)>& value) {
  constexpr int steps = 400'000;
  const double low = std::max(least, -10.0), high = std::max(low, 0.0) + 10;
  double weights = 0, sum = 0, squares = 0;
  for (int i = 0; i < steps; ++i) {
    const double z = low + (high - low) * (i + 0.5) / steps;
    const double weight = std::exp(0.5 * (std::pow(std::max(low, 0.0), 2) - z * z));
    weights += weight;
    sum += weight * value(z);
    squares += weight * value(z) * value(z);
  }
  return std::sqrt(squares / weights - sum / weights * sum / weights);
}

TEST(NormalSpread, QuadratureIsExactUpToItsPolynomialDegree) {
  const auto sum = [](const auto& rule, int degree) {
    double both_sides = 0;
    for (const QuadratureNode& node : rule)
      both_sides += 2 * node.weight * std::pow(node.position, degree);
    return both_sides;
  };
  for (int degree = 0; degree <= 30; degree += 2)
    EXPECT_NEAR(sum(legendre_16, degree), 2.0 / (degree + 1), 1e-15) << degree;
  // Moments of a normal distribution; for degree 0, the node at 0 has the remaining weight.
  double moment = 1;
  for (int degree = 2; degree <= 8; degree += 2) {
    moment *= degree - 1;
    EXPECT_NEAR(sum(hermite_5, degree), moment, 1e-14 * moment) << degree;
  }
}

TEST(NormalSpread, DeviationAboveAThresholdHasItsClosedForm) {
  const auto self = [](double z) { return z; };
  const double inf = std::numeric_limits<double>::infinity();
  // The tails beyond five standard deviations add 1.5e-5 to the variance.
  EXPECT_NEAR(deviation_above(-inf, self), 1, 1e-5);
  EXPECT_NEAR(deviation_above(-40, self), 1, 1e-5);
  EXPECT_NEAR(deviation_above(0, self), std::sqrt(1 - 2 / pi), 1e-5);
  EXPECT_EQ(deviation_above(0, [](double) { return 7.0; }), 0);
}

// Leading-edge time at which a Gaussian with a peak of p thresholds reaches a level disturbed by
// noise: nearly linear far below the peak, and like a square root near it.
TEST(NormalSpread, DeviationOfALeadingEdgeMatchesBruteForce) {
  for (const double threshold_sigmas : {4.0, 6.0, 10.0, 100.0}) {
    for (const double peak : {0.95, 1.0, 1.02, 1.1, 1.5, 3.0, 30.0, 1000.0}) {
      const double least = (1 - peak) * threshold_sigmas;
      if (least > 1) continue;  // few of them pass
      const auto rise = [&](double z) {
        const double level = std::max(1 - z / threshold_sigmas, 0.1);
        return level < peak ? -std::sqrt(2 * std::log(peak / level)) : 0;
      };
      const double expected = summed_deviation(least, rise);
      const double tolerance = peak < 1.2 ? 0.02 : 1e-3;
      EXPECT_NEAR(deviation_above(least, rise) / expected, 1, tolerance)
          << threshold_sigmas << ' ' << peak;
      testing::record_margin(peak < 1.2 ? "weak" : "strong",
                             deviation_above(least, rise) / expected - 1, tolerance);
    }
  }
}

TEST(NormalSpread, ClampedDeviationMatchesBruteForce) {
  for (const double deviation : {0.1, 0.5, 1.0, 4.0, 100.0}) {
    for (const double low : {-3.0, -1.0, -0.2}) {
      for (const double high : {0.1, 1.0, 2.5}) {
        const double expected =
            summed_deviation(-std::numeric_limits<double>::infinity(),
                             [&](double z) { return std::clamp(deviation * z, low, high); });
        // Steps of 5e-5 standard deviations; one step is cut off at each end.
        EXPECT_NEAR(clamped_normal_deviation(deviation, low, high), expected, 1e-4 * expected)
            << deviation << ' ' << low << ' ' << high;
      }
    }
  }
}

TEST(NormalSpread, ClampedDeviationHasItsLimits) {
  EXPECT_EQ(clamped_normal_deviation(0.25, -2, 2), 0.25);
  EXPECT_NEAR(clamped_normal_deviation(0.25, -1.99, 1.99), 0.25, 1e-14);
  // Two equally likely values: half of their distance.
  EXPECT_NEAR(clamped_normal_deviation(1e5, -1, 3), 2, 1e-4);
  EXPECT_NEAR(clamped_normal_deviation(std::numeric_limits<double>::infinity(), -1, 3), 2, 1e-4);
  EXPECT_EQ(clamped_normal_deviation(1, 0, 0), 0);
  EXPECT_EQ(clamped_normal_deviation(0, -1, 1), 0);
}

}  // namespace
}  // namespace groundray::normal_spread_test
