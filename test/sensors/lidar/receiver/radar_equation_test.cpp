#include "sensors/lidar/receiver/radar_equation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "core/appearance/material.h"
#include "core/error.h"

namespace groundray::radar_equation_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double pi = std::numbers::pi;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

LidarOptics optics() {
  return {.pulse_energy_j = 4e-7,
          .aperture_diameter_m = 0.03,
          .emitter_efficiency = 0.8,
          .receiver_efficiency = 0.6};
}

// Wagner et al. (2006), equations 2 to 5: the radar equation with the cross-section of an extended
// Lambertian target, the whole footprint of a beam with full divergence angle beta.
double energy_by_cross_section_j(double reflectance, double cos_incidence, double range_m,
                                 double transmission) {
  constexpr double beta_rad = 0.003;
  const double footprint_m2 = pi * range_m * range_m * beta_rad * beta_rad / 4;
  const double cross_section_m2 = 4 * pi / pi * reflectance * footprint_m2 * cos_incidence;
  return 4e-7 * 0.03 * 0.03 / (4 * pi * std::pow(range_m, 4) * beta_rad * beta_rad) * (0.8 * 0.6) *
         (transmission * transmission) * cross_section_m2;
}

TEST(RadarEquation, MatchesWagnersCrossSectionOfALambertianTarget) {
  const RadarEquation radar(optics());
  for (const double range_m : {1., 50., 3000.}) {
    for (const double cosine : {1., 0.5, 0.02}) {
      const double brdf_cos = retro_brdf_cos({.diffuse_per_sr = 0.4 / pi}, cosine);
      const double expected = energy_by_cross_section_j(0.4, cosine, range_m, 0.9);
      EXPECT_NEAR(radar.received_energy_j(1, brdf_cos, range_m, 0.9), expected,
                  32 * epsilon * expected);  // about twenty roundings on each side
    }
  }
}

// A disc of diameter D, seen from a Lambertian spot on its axis, receives sin^2(atan(D / 2R)) of
// the light that the spot reflects, without a small-angle approximation. The contract for the plane
// states 0.1 %.
TEST(RadarEquation, PowerOfALambertianSpotIsTheAperturesViewFactor) {
  const RadarEquation radar(optics());
  for (const double range_m : {0.5, 2., 10., 300.}) {
    const double half_angle_rad = std::atan(0.015 / range_m);
    const double exact_j =
        4e-7 * 0.8 * 0.6 * 0.25 * std::sin(half_angle_rad) * std::sin(half_angle_rad);
    const double energy_j =
        radar.received_energy_j(1, retro_brdf_cos({.diffuse_per_sr = 0.25 / pi}, 1), range_m, 1);
    const double tolerance = std::pow(0.015 / range_m, 2) + 32 * epsilon;
    EXPECT_LT(tolerance, 1e-3);
    EXPECT_NEAR(energy_j, exact_j, tolerance * exact_j);
  }
}

TEST(RadarEquation, EnergyFallsWithTheSquareOfTheRange) {
  const RadarEquation radar(optics());
  const double near_j = radar.received_energy_j(1, 0.1, 10, 1);
  const double far_j = radar.received_energy_j(1, 0.1, 1000, 1);
  EXPECT_NEAR(std::log(far_j / near_j) / std::log(100.), -2, 8 * epsilon);
}

TEST(RadarEquation, SubRaysSumToThePulse) {
  const RadarEquation radar(optics());
  const double whole_j = radar.received_energy_j(1, 0.1, 50, 0.8);
  double sum_j = 0;
  for (int i = 0; i < 64; ++i) sum_j += radar.received_energy_j(1. / 64, 0.1, 50, 0.8);
  EXPECT_NEAR(sum_j, whole_j, 64 * epsilon * whole_j);
}

// Sunlight on a perpendicular plane, summed over the patch inside a circular field of view: each
// ring of the patch irradiates the aperture by the inverse-square law and both cosines.
TEST(RadarEquation, SolarPowerIsTheIntegralOverTheFieldOfView) {
  constexpr double range_m = 40, angle_rad = 0.01, reflectance = 0.3;
  constexpr int rings = 2000;
  const SolarBackground sun{.irradiance_w_m2_nm = 0.8,
                            .filter_width_nm = 25,
                            .field_of_view_sr = cone_solid_angle_sr(angle_rad)};
  const double radius_m = range_m * std::tan(angle_rad / 2);
  double power_w = 0;
  for (int i = 0; i < rings; ++i) {
    const double r = (i + 0.5) * radius_m / rings;
    const double patch_m2 = 2 * pi * r * radius_m / rings;
    const double distance2 = range_m * range_m + r * r;
    const double cosine2 = range_m * range_m / distance2;
    power_w +=
        0.8 * 25 * reflectance / pi * patch_m2 * cosine2 / distance2 * (pi / 4 * 0.03 * 0.03);
  }
  power_w *= 0.6;
  // Cosines in the field of view differ from 1 by at most (angle / 2)^2 / 2.
  EXPECT_NEAR(RadarEquation(optics()).solar_power_w(sun, reflectance), power_w,
              angle_rad * angle_rad / 8 * power_w);
}

TEST(RadarEquation, SolidAngleOfConesOfHalfAndFullTurn) {
  EXPECT_NEAR(cone_solid_angle_sr(pi), 2 * pi, 8 * epsilon);
  EXPECT_NEAR(cone_solid_angle_sr(2 * pi), 4 * pi, 16 * epsilon);
  EXPECT_NEAR(cone_solid_angle_sr(1e-6), pi / 4 * 1e-12,
              1e-12 * 1e-12);  // relative difference angle^2 / 48
}

TEST(RadarEquation, ErrorListsEveryFault) {
  EXPECT_THAT(
      [] {
        RadarEquation({.pulse_energy_j = -1,
                       .aperture_diameter_m = std::numeric_limits<double>::quiet_NaN(),
                       .emitter_efficiency = 80,
                       .receiver_efficiency = 0});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("LidarOptics:"), HasSubstr("pulse_energy_j = -1"),
                                 HasSubstr("aperture_diameter_m = nan"),
                                 HasSubstr("emitter_efficiency = 80 must be in (0, 1]"),
                                 HasSubstr("receiver_efficiency = 0"))));
  const RadarEquation radar(optics());
  EXPECT_THAT(
      [&] {
        radar.solar_power_w(
            {.irradiance_w_m2_nm = -1, .filter_width_nm = -2, .field_of_view_sr = 7}, 30);
      },
      ThrowsMessage<Error>(
          AllOf(HasSubstr("irradiance_w_m2_nm = -1"), HasSubstr("filter_width_nm = -2"),
                HasSubstr("field_of_view_sr = 7"), HasSubstr("reflectance = 30"))));
}

}  // namespace
}  // namespace groundray::radar_equation_test
