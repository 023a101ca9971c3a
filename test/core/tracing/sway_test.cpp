#include "core/tracing/sway.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "core/error.h"
#include "test/support/margin.h"

namespace groundray::sway_test {
namespace {

using std::numbers::pi;

const Wind westerly{.speed_m_s = 6, .towards = {1, 0}, .turbulence = 0.2};
const Flexibility tree{.frequency_hz = 0.65, .lean_rad = 0.03};

std::vector<double> samples(const Sway& sway, double step_s, std::size_t count, double scale,
                            int component) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i)
    values.push_back(
        sway.lean({31, -7}, scale, step_s * static_cast<double>(i)).tangent[component]);
  return values;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double deviation_of(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

// Variance of a damped oscillator of unit stiffness in wind of unit variance with the spectrum of
// Kaimal et al. (1972), f S / u*^2 = a n / (1 + b n)^(5/3): integrated over the logarithm of f.
double driven_variance(double frequency_hz, double speed_m_s, double a, double b) {
  constexpr double damping = 0.1;
  double driven = 0, all = 0;
  for (double log_f = std::log(1e-6); log_f < std::log(1e4); log_f += 1e-3) {
    const double f = std::exp(log_f), n = f * 10 / speed_m_s;
    const double density = a * n / std::pow(1 + b * n, 5.0 / 3);
    const double r = f / frequency_hz;
    all += density;
    driven += density / (std::norm(std::complex(1 - r * r, 2 * damping * r)));
  }
  return driven / all;
}

TEST(Sway, MeanAndDeviationAreThoseOfADampedOscillatorInTurbulentWind) {
  for (const double frequency_hz : {0.4, 0.65, 2.0, 4.0}) {
    const Sway sway(westerly, {frequency_hz, 0.03});
    const double static_tangent = std::tan(0.03) * 0.6;
    const std::vector<double> along = samples(sway, 0.05, 400'000, 1, 0);
    const std::vector<double> across = samples(sway, 0.05, 400'000, 1, 1);
    EXPECT_NEAR(mean_of(along), static_tangent, 0.005 * static_tangent);
    EXPECT_NEAR(mean_of(across), 0, 0.005 * static_tangent);
    const double expected =
        0.2 * static_tangent * std::sqrt(driven_variance(frequency_hz, 6, 105, 33));
    // Stiff plants also follow the fifth of the gusts' variance that has no wave.
    EXPECT_NEAR(deviation_of(along) / expected, 1, 0.1) << frequency_hz;
    testing::record_margin("deviation", deviation_of(along) / expected - 1, 0.1);
    // sigma_v / sigma_u of the same authors' spectra: the integrals of 105 n / (1 + 33 n)^(5/3) and
    // 17 n / (1 + 9.5 n)^(5/3) over log n are 105 / 22 and 17 / (9.5 * 2 / 3).
    EXPECT_NEAR(deviation_of(across) / deviation_of(along), std::sqrt(17 / 9.5 / (105.0 / 33)),
                0.01);
  }
}

// Amplitude of a component of the signal, by a Fourier sum under a Hann window.
double amplitude_at(const std::vector<double>& values, double step_s, double frequency_hz) {
  std::complex<double> sum = 0;
  const double mean = mean_of(values);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double turn = static_cast<double>(i) / static_cast<double>(values.size());
    const double window = 1 - std::cos(2 * pi * turn);
    sum += window * (values[i] - mean) *
           std::polar(1.0, -2 * pi * frequency_hz * step_s * static_cast<double>(i));
  }
  return 2 * std::abs(sum) / static_cast<double>(values.size());
}

TEST(Sway, SpectrumHasThePeaksOfGustsAndOfThePlantsFrequency) {
  const Sway sway(westerly, tree);
  for (const double scale : {1.0, 0.5, 2.0}) {
    const std::vector<double> along = samples(sway, 0.05, 60'000, scale, 0);
    const double gain = std::tan(0.03) / 10;
    // Waves at the quantiles of F(n) = 1 - (1 + 33 n)^(-2/3), n = f 10 m / U, of amplitude
    // sigma (2 / 5)^(1/2).
    for (const double quantile : {0.1, 0.3, 0.5, 0.7}) {
      const double rate_hz = 0.6 * (std::pow(1 - quantile, -1.5) - 1) / 33;
      EXPECT_NEAR(amplitude_at(along, 0.05, rate_hz), gain * 1.2 * std::sqrt(0.4), 2e-3 * gain);
    }
    double peak_hz = 0, peak = 0;
    const std::vector<double> start(along.begin(), along.begin() + 4000);
    for (double f = 0.15; f < 3; f += 2e-3) {
      const double here = amplitude_at(start, 0.05, f);
      if (here > peak) {
        peak = here;
        peak_hz = f;
      }
    }
    EXPECT_NEAR(peak_hz * scale / 0.65, 1, 0.055) << scale;
    const double sides = amplitude_at(along, 0.05, 0.95 * 0.65 / scale) /
                         amplitude_at(along, 0.05, 1.05 * 0.65 / scale);
    EXPECT_NEAR(sides, 1, 1e-3);
    EXPECT_LT(amplitude_at(along, 0.05, 0.65 / scale), 0.02 * peak);  // it beats
  }
}

TEST(Sway, GustsTravelWithTheWind) {
  const glm::dvec2 towards = glm::normalize(glm::dvec2(-2, 1));
  const Sway sway({.speed_m_s = 8, .towards = towards, .turbulence = 0.3}, tree);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place(-500, 500), when(0, 60);
  double most = 0;
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec2 p(place(random), place(random));
    const double time_s = when(random), later_s = when(random);
    const Lean here = sway.lean(p, 1.3, time_s);
    const Lean there = sway.lean(p + 8 * later_s * towards, 1.3, time_s + later_s);
    EXPECT_NEAR(here.tangent.x, there.tangent.x, 1e-13);
    EXPECT_NEAR(here.tangent.y, there.tangent.y, 1e-13);
    most = std::max(most, glm::distance(here.tangent, sway.lean(p, 1.3, time_s + later_s).tangent));
  }
  EXPECT_GT(most, 0.01);
}

TEST(Sway, PlantsStayInPlaceIfTheOriginOfDMoves) {
  Wind moved = westerly;
  moved.origin_w_m = {429'000, 5'150'000};
  const Sway there(moved, tree);
  moved.origin_w_m += glm::dvec2(100, -40);
  const Sway here(moved, tree);
  for (int i = 0; i < 100; ++i) {
    const glm::dvec2 p(3.1 * i, -i);
    const glm::dvec2 a = there.lean(p, 1, i).tangent;
    const glm::dvec2 b = here.lean(p - glm::dvec2(100, -40), 1, i).tangent;
    EXPECT_LT(glm::distance(a, b), 1e-9);
  }
}

TEST(Sway, AnotherVariantGivesOtherGustsOfTheSameStrength) {
  Wind other = westerly;
  other.variant = 1;
  const std::vector<double> one = samples(Sway(westerly, tree), 0.5, 20'000, 1, 0);
  const std::vector<double> two = samples(Sway(other, tree), 0.5, 20'000, 1, 0);
  EXPECT_NEAR(deviation_of(two) / deviation_of(one), 1, 0.02);
  const double mean = mean_of(one), other_mean = mean_of(two);
  double correlation = 0;
  for (std::size_t i = 0; i < one.size(); ++i)
    correlation += (one[i] - mean) * (two[i] - other_mean);
  correlation /= static_cast<double>(one.size()) * deviation_of(one) * deviation_of(two);
  EXPECT_LT(std::abs(correlation), 0.9);
}

TEST(Sway, RangeContainsAllInclinationsAndIsTight) {
  for (const double from : {0.0, 0.7, 2.5, 4.0}) {
    const Sway sway(
        {.speed_m_s = 12, .towards = {std::cos(from), std::sin(from)}, .turbulence = 0.4},
        {1.1, 0.5});
    const auto [low, high] = sway.range();
    glm::dvec2 least(1e9), most(-1e9);
    for (int i = 0; i < 2'000'000; ++i) {
      const glm::dvec2 tangent = sway.lean({i % 97, i % 89}, 0.5 + i % 7, 0.37 * i).tangent;
      least = glm::min(least, tangent);
      most = glm::max(most, tangent);
    }
    for (int k = 0; k < 2; ++k) {
      EXPECT_LE(low[k], least[k]);
      EXPECT_GE(high[k], most[k]);
      EXPECT_GT(most[k] - least[k], 0.9 * (high[k] - low[k]));
    }
  }
}

TEST(Sway, SeveralTimesGiveTheSameBitsAsEachAlone) {
  const Sway sway(westerly, tree);
  for (std::size_t count = 1; count <= 9; ++count) {
    std::vector<double> times_s;
    for (std::size_t i = 0; i < count; ++i) times_s.push_back(0.1 * static_cast<double>(i * i));
    std::vector<Lean> leans(count);
    sway.lean({3, 4}, 0.8, times_s, leans);
    for (std::size_t i = 0; i < count; ++i) {
      const Lean alone = sway.lean({3, 4}, 0.8, times_s[i]);
      EXPECT_EQ(leans[i].tangent, alone.tangent);
      EXPECT_EQ(leans[i].secant, alone.secant);
    }
  }
}

// A vertical line of length h turns to h (t, 1) / |(t, 1)|; tangents of a surface stay
// perpendicular to its normal.
TEST(Sway, LeanKeepsTheLengthsOfStemsAndMapsNormals) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  const auto vector = [&] {
    const double x = normal(random), y = normal(random), z = normal(random);
    return glm::dvec3(x, y, z);
  };
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec2 tangent(vector());
    const Lean lean{tangent, std::sqrt(1 + glm::dot(tangent, tangent))};
    EXPECT_NEAR(glm::length(lean.leaning({0, 0, 3})), 3, 1e-14);
    EXPECT_EQ(lean.leaning({1, 2, 0}), glm::dvec3(1, 2, 0));
    const glm::dvec3 a = vector(), b = vector();
    EXPECT_LT(glm::distance(lean.upright(lean.leaning(a)), a), 1e-14 * (1 + glm::length(a)) * 20);
    const glm::dvec3 expected = glm::normalize(glm::cross(lean.leaning(a), lean.leaning(b)));
    const glm::dvec3 mapped = glm::normalize(lean.leaning_normal(glm::cross(a, b)));
    EXPECT_LT(glm::distance(mapped, expected), 1e-10);
    EXPECT_LT(glm::distance(glm::normalize(lean.upright_normal(mapped)),
                            glm::normalize(glm::cross(a, b))),
              1e-10);
  }
}

TEST(Sway, VelocityIsTheDerivativeOfThePosition) {
  const Sway sway({.speed_m_s = 15, .towards = {0, 1}, .turbulence = 0.3}, {0.9, 0.6});
  constexpr double step_s = 1e-4;
  double fastest = 0;
  for (int i = 0; i < 500; ++i) {
    const glm::dvec2 p(1.7 * i, 0.3 * i);
    const auto tip = [&](double time_s) {
      return sway.lean(p, 1.2, time_s).leaning({0.3, 0.1, 4});
    };
    const double time_s = 0.11 * i;
    const glm::dvec3 expected = (tip(time_s + step_s) - tip(time_s - step_s)) / (2 * step_s);
    const glm::dvec3 velocity = sway.velocity_m_s(p, 1.2, time_s, tip(time_s).z);
    EXPECT_LT(glm::distance(velocity, expected), 1e-5);
    fastest = std::max(fastest, glm::length(velocity));
  }
  EXPECT_GT(fastest, 1);
}

TEST(Sway, IsStillWithoutWindOrFlexibility) {
  EXPECT_TRUE(Sway().is_still());
  EXPECT_TRUE(Sway({}, tree).is_still());
  EXPECT_TRUE(Sway(westerly, {0.65, 0}).is_still());
  EXPECT_FALSE(Sway(westerly, tree).is_still());
  EXPECT_FALSE(Sway().lean({1, 2}, 1, 3));
}

TEST(Sway, RejectsValuesOutOfBounds) {
  try {
    const Sway sway({.speed_m_s = 31, .towards = {2, 0}, .turbulence = -0.1}, {0, 1.1});
    FAIL();
  } catch (const Error& error) {
    for (const char* text :
         {"speed_m_s = 31 must be 0, or from 0.1 to 30", "towards = (2, 0) must be a unit vector",
          "turbulence = -0.1 must be from 0 to 0.5",
          "frequency_hz = 0 of a plant must be from 0.01 to 100",
          "lean_rad = 1.1 of a plant must be from 0 to 1"})
      EXPECT_THAT(error.what(), ::testing::HasSubstr(text));
  }
  EXPECT_THROW(Sway({.speed_m_s = std::numeric_limits<double>::quiet_NaN()}, tree), Error);
}

}  // namespace
}  // namespace groundray::sway_test
