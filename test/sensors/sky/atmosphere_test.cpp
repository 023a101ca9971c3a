#include "sensors/sky/atmosphere.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "sensors/lidar/receiver/radar_equation.h"
#include "test/support/margin.h"

namespace groundray::atmosphere_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr Overlap overlap{.none_below_m = 0.9, .full_from_m = 1};  // Hahner et al. (2021)

RadarEquation radar() {
  return RadarEquation({.pulse_energy_j = 1.6e-6, .aperture_diameter_m = 0.1});
}

double receiver_area_m2() { return std::numbers::pi / 4 * 0.1 * 0.1; }

// Adaptive Simpson quadrature in long double, to 1e-14 of the integral.
template <typename Function>
long double integral(Function f, long double a, long double b, long double fa, long double fm,
                     long double fb, long double whole, long double tolerance, int depth) {
  const long double m = (a + b) / 2;
  const long double fl = f((a + m) / 2);
  const long double fr = f((m + b) / 2);
  const long double left = (m - a) / 6 * (fa + 4 * fl + fm);
  const long double right = (b - m) / 6 * (fm + 4 * fr + fb);
  const long double rest = left + right - whole;
  if (depth == 0 || std::abs(rest) <= 15 * tolerance) return left + right + rest / 15;
  return integral(f, a, m, fa, fl, fm, left, tolerance / 2, depth - 1) +
         integral(f, m, b, fm, fr, fb, right, tolerance / 2, depth - 1);
}

template <typename Function>
long double integral(Function f, long double a, long double b) {
  if (!(a < b)) return 0;
  const long double fa = f(a), fm = f((a + b) / 2), fb = f(b);
  const long double whole = (b - a) / 6 * (fa + 4 * fm + fb);
  return integral(f, a, b, fa, fm, fb, whole, 1e-14L * std::abs(whole), 40);
}

// Backscatter per metre of air at range r: beta A / r^2 exp(-2 alpha r) xi(r), for 1 J.
long double soft_target(long double alpha, long double beta, const Overlap& seen, long double r) {
  const long double xi = (r - seen.none_below_m) / (seen.full_from_m - seen.none_below_m);
  return beta * receiver_area_m2() / (r * r) * std::exp(-2 * alpha * r) *
         std::min(1.0L, std::max(0.0L, xi));
}

TEST(Atmosphere, VacuumIsTheDefault) {
  const Atmosphere air({}, 905);
  EXPECT_EQ(air.transmission(1e5), 1);
  EXPECT_EQ(air.group_index(), 1);
  EXPECT_TRUE(radar().soft_return(air, overlap, {.step_m = 1, .max_range_m = 100}).empty());
}

// Beer-Lambert as a differential equation, dT/dr = -alpha T, in thin slabs of linear loss.
TEST(Atmosphere, TransmissionIsTheProductOfThinSlabs) {
  const Atmosphere air({.fog_range_m = 80, .rain_mm_h = 20}, 905);
  constexpr int slabs = 1 << 20;
  constexpr double range_m = 60;
  const double depth = air.extinction_per_m() * range_m;
  long double transmission = 1;
  for (int i = 0; i < slabs; ++i) transmission *= 1 - static_cast<long double>(depth) / slabs;
  // (1 - x/n)^n = exp(-x) (1 - x^2 / 2n + ...)
  EXPECT_NEAR(air.transmission(range_m), static_cast<double>(transmission),
              depth * depth / slabs * air.transmission(range_m));
}

TEST(Atmosphere, TwoPercentOfContrastRemainAtTheVisibilityInGreenLight) {
  for (const double visibility_m : {200., 700., 3000., 23'000., 80'000.}) {
    for (const HazeLaw law : {HazeLaw::Kruse, HazeLaw::Kim}) {
      EXPECT_NEAR(haze_extinction_per_m(visibility_m, 550, law), 3.912 / visibility_m,
                  2 * epsilon * 3.912 / visibility_m);
      const Atmosphere air({.visibility_m = visibility_m, .haze_law = law}, 550);
      EXPECT_NEAR(air.transmission(visibility_m), 0.02, 1e-6);  // ln 50 = 3.91202, not 3.912
    }
  }
}

// Recovers the exponents of Kim et al. (2001) and Kruse et al. (1962) from two wavelengths.
TEST(Atmosphere, HazeFollowsThePublishedExponents) {
  const auto exponent = [](double visibility_m, HazeLaw law) {
    return std::log(haze_extinction_per_m(visibility_m, 550, law) /
                    haze_extinction_per_m(visibility_m, 1100, law)) /
           std::numbers::ln2;
  };
  struct Row {
    double visibility_m, kim, kruse;
  };
  for (const Row& row :
       {Row{60'000, 1.6, 1.6}, Row{50'000, 1.3, 1.3}, Row{10'000, 1.3, 1.3},
        Row{6000, 1.3, 0.585 * 1.8171205928321397}, Row{4000, 0.98, 0.585 * 1.5874010519681994},
        Row{1000, 0.5, 0.585}, Row{800, 0.3, 0.585 * 0.9283177667225558},
        Row{500, 0, 0.585 * 0.7937005259840998}}) {
    EXPECT_NEAR(exponent(row.visibility_m, HazeLaw::Kim), row.kim, 1e-12);
    EXPECT_NEAR(exponent(row.visibility_m, HazeLaw::Kruse), row.kruse, 1e-12);
  }
}

TEST(Atmosphere, FogTransmitsFivePercentAtItsRange) {
  for (const double range_m : {20., 50., 500.}) {
    const Atmosphere air({.fog_range_m = range_m}, 1550);
    EXPECT_NEAR(air.transmission(range_m), 0.05, 4 * epsilon);
    EXPECT_EQ(air.backscatter_per_m_sr(), 0.046 / range_m);
  }
}

// Other simulators use 30 to 40 times the extinction: 37 % and 2 % would remain.
TEST(Atmosphere, RainAttenuatesLittleOverFiftyMetres) {
  for (const auto& [rain_mm_h, left] : {std::pair{1., 0.976}, std::pair{10., 0.89}}) {
    const double one_way = Atmosphere({.rain_mm_h = rain_mm_h}, 905).transmission(50);
    EXPECT_NEAR(one_way * one_way, left, 1e-3);  // to the digits of the published figures
  }
}

TEST(Atmosphere, ExtinctionsAdd) {
  const double fog = Atmosphere({.fog_range_m = 100}, 905).extinction_per_m();
  const double rain = Atmosphere({.rain_mm_h = 5}, 905).extinction_per_m();
  EXPECT_DOUBLE_EQ(Atmosphere({.fog_range_m = 100, .rain_mm_h = 5}, 905).extinction_per_m(),
                   fog + rain);
}

// n - wavelength dn/dwavelength by central differences of Ciddor's phase index n (1996), as the
// package ref_index 1.0 computes it for dry air with 375 ppm CO2: an independent model of density
// and dispersion. The closed formula omits the compressibility of air, 0.1e-6 here.
TEST(Atmosphere, GroupIndexOfAirMatchesCiddorsDispersion) {
  struct Row {
    double wavelength_nm, temperature_c, pressure_pa, refractivity;
  };
  for (const Row& row :
       {Row{532, 15, 101'325, 289.7359986e-6}, Row{905, 15, 101'325, 278.3236516e-6},
        Row{905, 0, 101'325, 293.6595442e-6}, Row{905, -20, 80'000, 250.2015263e-6},
        Row{1064, 40, 70'000, 175.8619881e-6}, Row{1550, 15, 101'325, 274.5344648e-6}}) {
    EXPECT_NEAR(air_group_index(row.wavelength_nm, row.temperature_c, row.pressure_pa),
                1 + row.refractivity, 0.15e-6);
  }
}

class SoftReturnSteps : public ::testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(SoftReturnSteps, EachStepHasTheEnergyAndTheCentroidOfItsIntegral) {
  const auto [fog_range_m, step_m] = GetParam();
  const Atmosphere air({.fog_range_m = fog_range_m}, 905);
  const auto returns = radar().soft_return(air, overlap, {.step_m = step_m, .max_range_m = 40.25});
  const long double alpha = std::log(20.0L) / fog_range_m;
  const long double beta = 0.046L / fog_range_m;
  auto next = returns.begin();
  for (double near_m = 0; near_m < 40.25; near_m += step_m) {  // steps are exact in binary
    const double far_m = std::min(near_m + step_m, 40.25);
    long double energy_j = 0, moment = 0;
    for (const auto& [from, to] : {std::pair{std::max(near_m, 0.9), std::min(far_m, 1.)},
                                   std::pair{std::max(near_m, 1.), far_m}}) {
      const auto f = [&](long double r) { return 1.6e-6L * soft_target(alpha, beta, overlap, r); };
      energy_j += integral(f, from, to);
      moment += integral([&](long double r) { return r * f(r); }, from, to);
    }
    if (far_m <= 0.9) continue;
    ASSERT_NE(next, returns.end());
    // The accuracy that the contract states.
    EXPECT_NEAR(next->energy_j, static_cast<double>(energy_j), 1e-9 * next->energy_j);
    EXPECT_NEAR(next->range_m, static_cast<double>(moment / energy_j), 1e-9 * next->range_m);
    testing::record_margin("energy of a step", next->energy_j / static_cast<double>(energy_j) - 1,
                           1e-9);
    testing::record_margin("its range", next->range_m / static_cast<double>(moment / energy_j) - 1,
                           1e-9);
    ++next;
  }
  EXPECT_EQ(next, returns.end());
}

INSTANTIATE_TEST_SUITE_P(Atmosphere, SoftReturnSteps,
                         ::testing::Combine(::testing::Values(5., 50., 2000.),
                                            ::testing::Values(0.0625, 0.5, 8.)));

// Received power of Rasshofer et al. (2011) as Hahner et al. (2021) evaluate it: for a pulse of 80
// W sin^2(pi t / 2 tau) over 2 tau = 40 ns, the power at range R of the clock is C_A P0 beta
// Int_0^{2 tau} sin^2(pi t / 2 tau) exp(-2 alpha r) / r^2 xi(r) dt, r = R - c t / 2, C_A = c A / 2.
// It is compared with the sum over the steps, each a copy of the pulse with the step's energy.
TEST(Atmosphere, FogEchoEqualsThePublishedIntegral) {
  constexpr double c = 299'792'458, tau_s = 20e-9, peak_w = 80, step_m = 1. / 512;
  const Atmosphere air({.fog_range_m = 50}, 905);
  const auto returns = radar().soft_return(air, overlap, {.step_m = step_m, .max_range_m = 60});
  const auto shape = [&](long double t) {
    const long double s = std::sin(std::numbers::pi_v<long double> * t / (2 * tau_s));
    return t < 0 || t > 2 * tau_s ? 0 : s * s;
  };
  const long double alpha = std::log(20.0L) / 50, beta = 0.046L / 50;
  // Concentrating a step's energy at its centre causes an error of its variance, at most step^2 /
  // 4, times half the curvature of the pulse shape over range, at most 2 (pi / c tau)^2.
  const double curvature_m2 = 2 * std::pow(std::numbers::pi / (c * tau_s), 2);
  const double error = step_m * step_m / 4 * curvature_m2 / 2;
  double soft_j = 0;
  for (const SoftReturn& step : returns) soft_j += step.energy_j;
  for (const double range_m : {1., 2., 3.5, 5., 7., 10., 20., 40.}) {
    const auto f = [&](long double t) {
      return shape(t) * soft_target(alpha, beta, overlap, range_m - c * t / 2);
    };
    long double expected_w = 0;
    const long double ends[] = {0, 2 * (range_m - 1.0L) / c, 2 * (range_m - 0.9L) / c};
    for (int i = 0; i < 2; ++i) {
      expected_w += c / 2 * peak_w *
                    integral(f, std::clamp(ends[i], 0.0L, 2.0L * tau_s),
                             std::clamp(ends[i + 1], 0.0L, 2.0L * tau_s));
    }
    long double power_w = 0;
    for (const SoftReturn& step : returns) {
      power_w += step.energy_j / tau_s * shape(2 * (range_m - step.range_m) / c);
    }
    EXPECT_NEAR(static_cast<double>(power_w), static_cast<double>(expected_w),
                error * soft_j / tau_s);
    testing::record_margin("power",
                           static_cast<double>(power_w - expected_w) / (error * soft_j / tau_s), 1);
    EXPECT_GT(static_cast<double>(expected_w), 10 * error * soft_j / tau_s) << range_m;
  }
}

TEST(Atmosphere, SoftReturnEndsWhereItIsTooWeak) {
  const Atmosphere air({.fog_range_m = 50}, 905);
  const auto all = radar().soft_return(air, overlap, {.step_m = 0.5, .max_range_m = 100});
  const auto some =
      radar().soft_return(air, overlap, {.step_m = 0.5, .max_range_m = 100, .least_share = 1e-3});
  double strongest_j = 0;
  for (const SoftReturn& step : all) strongest_j = std::max(strongest_j, step.energy_j);
  ASSERT_LT(some.size(), all.size());
  EXPECT_GE(some.back().energy_j, 1e-3 * strongest_j);
  EXPECT_LT(all[some.size()].energy_j, 1e-3 * strongest_j);
}

TEST(Atmosphere, ErrorListsEveryFault) {
  EXPECT_THAT(
      [] {
        Atmosphere({.visibility_m = 0,
                    .fog_range_m = -5,
                    .rain_mm_h = -1,
                    .backscatter_per_m_sr = -1,
                    .group_index = 1.3},
                   0.905);
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("AtmosphereSpec:"), HasSubstr("visibility_m = 0"),
                                 HasSubstr("fog_range_m = -5"), HasSubstr("rain_mm_h = -1"),
                                 HasSubstr("backscatter_per_m_sr = -1"),
                                 HasSubstr("group_index = 1.3"),
                                 HasSubstr("= 0.905 nm must be in [400, 2000]"))));
  EXPECT_THAT([] { Atmosphere({.visibility_m = 100, .fog_range_m = 100}, 905); },
              ThrowsMessage<Error>(HasSubstr("are alternatives")));
  EXPECT_THAT(
      [] {
        radar().soft_return(Atmosphere({}, 905), {.none_below_m = 0, .full_from_m = 0},
                            {.step_m = 0, .max_range_m = -1, .least_share = 1});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("none_below_m = 0"), HasSubstr("full_from_m = 0"),
                                 HasSubstr("step_m = 0"), HasSubstr("max_range_m = -1"),
                                 HasSubstr("least_share = 1"))));
  EXPECT_THAT(
      [] { air_group_index(0.905, 288, 1013); },
      ThrowsMessage<Error>(AllOf(HasSubstr("wavelength_nm = 0.905"), HasSubstr("is it in kelvins?"),
                                 HasSubstr("is it in hectopascals?"))));
}

}  // namespace
}  // namespace groundray::atmosphere_test
