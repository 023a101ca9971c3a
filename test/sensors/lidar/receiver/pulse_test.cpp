#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "sensors/lidar/receiver/waveform.h"

namespace groundray::pulse_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Midpoint rule over the support: for smooth pulses it converges faster than any power.
struct Sums {
  double integral = 0, centroid_s = 0, variance_s2 = 0;
};
Sums sums_of(const SystemPulse& pulse) {
  constexpr int n = 20'000;
  const double step_s = (pulse.end_s() - pulse.begin_s()) / n;
  double moments[3] = {};
  for (int i = 0; i < n; ++i) {
    const double t_s = pulse.begin_s() + (i + 0.5) * step_s;
    const double part = pulse(t_s) * step_s;
    moments[0] += part;
    moments[1] += part * t_s;
    moments[2] += part * t_s * t_s;
  }
  return {moments[0], moments[1], moments[2]};
}

PulseSpec table(std::vector<double> shape, double step_s) {
  return {.shape = std::move(shape), .shape_step_s = step_s};
}

PulseSpec gaussian_table(double sigma_s, double step_s) {
  std::vector<double> shape;
  const int n = static_cast<int>(std::ceil(7 * sigma_s / step_s));
  for (int i = -n; i <= n; ++i) shape.push_back(std::exp(-0.5 * std::pow(i * step_s / sigma_s, 2)));
  return table(std::move(shape), step_s);
}

TEST(Pulse, VariancesOfAGaussianAndItsResponseAdd) {
  const SystemPulse pulse({.fwhm_s = 4e-9}, 3e-9 / fwhm_per_sigma);
  EXPECT_DOUBLE_EQ(pulse.fwhm_s(), 5e-9);  // 3, 4, 5
  const double sigma_s = 5e-9 / (2 * std::sqrt(2 * std::numbers::ln2));
  for (const double t_s : {0.0, 1e-9, -2.5e-9, 7e-9}) {
    const double expected = std::exp(-0.5 * t_s * t_s / (sigma_s * sigma_s)) /
                            (sigma_s * std::sqrt(2 * std::numbers::pi));
    EXPECT_NEAR(pulse(t_s), expected, 1e-13 * expected);
  }
  EXPECT_NEAR(pulse(pulse.end_s()), 1e-7 * pulse.peak_per_s(), 1e-19 * pulse.peak_per_s());
  EXPECT_NEAR(pulse.rise_s(0.5), -2.5e-9, 1e-22);
}

TEST(Pulse, EveryShapeHasUnitIntegralAndItsCentroidAtZero) {
  // A Gaussian cut off at 1e-7 of its peak lacks 1e-8 of its integral; for a table that ends in a
  // ramp the error of the midpoint rule is smaller.
  for (const double response_s : {0.0, 0.3e-9, 2e-9}) {
    for (const auto& shape : {std::vector<double>{1}, {0, 3, 7, 4, 2, 1, 0.5, 0.2}, {1, 1, 1, 5}}) {
      const Sums sums = sums_of(SystemPulse(table(shape, 1e-9), response_s));
      EXPECT_NEAR(sums.integral, 1, 5e-8);
      EXPECT_NEAR(sums.centroid_s, 0, 5e-8 * 5e-9);
    }
  }
}

TEST(Pulse, VarianceIsTheSumOfTableHatAndResponse) {
  const std::vector<double> shape{0, 3, 7, 4, 2, 1, 0.5, 0.2};
  double sum = 0, first = 0, second = 0;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const auto x = static_cast<double>(i);
    sum += shape[i], first += shape[i] * x, second += shape[i] * x * x;
  }
  const double of_table = second / sum - first * first / (sum * sum);
  const double expected = (of_table + 1.0 / 6 + 4) * 1e-18;  // hat function: step^2 / 6
  const Sums sums = sums_of(SystemPulse(table(shape, 1e-9), 2e-9));
  // The missing 1e-8 lies at up to 5.7 sigma + 6 ns: 33 + 14 times the variance.
  EXPECT_NEAR(sums.variance_s2, expected, 1e-6 * expected);
}

TEST(Pulse, TableOfAGaussianEqualsTheGaussian) {
  constexpr double sigma_s = 2e-9, step_s = sigma_s / 40;
  // Between samples a straight line errs by step^2 / 8 times the second derivative, which is at
  // most 1 / sigma^2 of the peak.
  constexpr double tolerance = 1.01 / (8 * 40 * 40);
  const PulseSpec exact{.fwhm_s = sigma_s * fwhm_per_sigma};
  for (const double response_s : {0.0, 0.5e-9, 2e-9}) {
    const SystemPulse gaussian(exact, response_s);
    const SystemPulse measured(gaussian_table(sigma_s, step_s), response_s);
    for (double t_s = -12e-9; t_s < 12e-9; t_s += 0.37e-9) {
      EXPECT_NEAR(measured(t_s), gaussian(t_s), tolerance * gaussian.peak_per_s()) << t_s;
    }
    EXPECT_NEAR(measured.peak_per_s(), gaussian.peak_per_s(), tolerance * gaussian.peak_per_s());
    EXPECT_NEAR(measured.fwhm_s(), gaussian.fwhm_s(), 4 * tolerance * sigma_s);
    // At the fraction f the slope is f sqrt(2 ln(1 / f)) / sigma, relative to the peak: 0.46 for
    // 0.9.
    for (const double fraction : {0.2, 0.5, 0.9}) {
      EXPECT_NEAR(measured.rise_s(fraction), gaussian.rise_s(fraction), 3 * tolerance * 2.9e-9);
    }
  }
}

TEST(Pulse, WidthOfATriangleIsExact) {
  const SystemPulse pulse(table({0, 1, 0}, 2e-9), 0);
  EXPECT_NEAR(pulse.peak_per_s(), 0.5e9, 1);
  EXPECT_NEAR(pulse.peak_s(), 0, 1e-20);
  EXPECT_NEAR(pulse.fwhm_s(), 2e-9, 1e-20);
  EXPECT_NEAR(pulse.rise_s(0.25), -1.5e-9, 1e-20);
}

TEST(Pulse, RejectsInvalidPulses) {
  EXPECT_THAT([] { SystemPulse({}, 0); }, ThrowsMessage<Error>(HasSubstr("fwhm_s = 0")));
  EXPECT_THAT(
      [] {
        SystemPulse({.fwhm_s = 1e-9, .shape = {0, -1}}, 0);
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("and a shape"), HasSubstr("shape_step_s = 0"),
                                 HasSubstr("not negative"),
                                 HasSubstr("at least one value must be positive"))));
}

}  // namespace
}  // namespace groundray::pulse_test
