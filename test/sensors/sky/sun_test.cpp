#include "sensors/sky/sun.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "core/error.h"
#include "test/support/margin.h"

namespace groundray::sun_test {
namespace {

using namespace std::chrono_literals;
using std::chrono::sys_days;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double pi = std::numbers::pi;

Sun sun_at(double azimuth_deg, double elevation_deg, SunDisc disc = SunDisc::LimbDarkened,
           const ClearAir& air = {}) {
  return Sun({.position = SunAngles{azimuth_deg, elevation_deg}, .disc = disc}, air);
}

double angle_deg(const glm::dvec3& a, const glm::dvec3& b) {
  return glm::degrees(2 * std::asin(glm::distance(a, b) / 2));
}

// The example of Reda and Andreas, Solar position algorithm for solar radiation applications,
// NREL/TP-560-34302 (2008), appendix A.5: zenith 50.11162, azimuth 194.34024 degrees. groundray's
// algorithm is accurate to 0.01 degrees.
TEST(SunPosition, MatchesTheExampleOfNrel) {
  const auto utc = sys_days(2003y / 10 / 17) + 19h + 30min + 30s;
  const SunPosition sun = sun_position(utc, {39.742476, -105.1786, 820, 11});
  const glm::dvec3 expected = direction_of(glm::radians(194.34024), glm::radians(90 - 50.11162));
  EXPECT_LT(angle_deg(sun.direction, expected), 0.01);
  testing::record_margin("direction of the sun", angle_deg(sun.direction, expected), 0.01, "°");
}

// Computed with NREL's algorithm as in pvlib 0.16.1 (spa.solar_position_numpy, delta_t = 69 s),
// without refraction; its uncertainty is 0.0003 degrees.
TEST(SunPosition, MatchesNrelsAlgorithmWorldwide) {
  struct Row {
    std::chrono::sys_seconds utc;
    double latitude_deg, longitude_deg, azimuth_deg, elevation_deg, distance_au;
  };
  const Row rows[] = {
      {sys_days(1990y / 1 / 1) + 12h, 51.5, 0, 179.15772, 15.49170, 0.983328},
      {sys_days(1994y / 6 / 21) + 18h + 30min, -33.9, -70.6, 332.58546, 27.37796, 1.016250},
      {sys_days(2012y / 2 / 29) + 3h + 15min + 45s, 35.68, 139.69, 187.88251, 46.16993, 0.990664},
      {sys_days(2020y / 3 / 20) + 12h, 0, 0, 85.80245, 88.16101, 0.996016},
      {sys_days(2024y / 6 / 20) + 21h, 64.1, -21.9, 300.14073, 11.73663, 1.016195},
      {sys_days(2026y / 9 / 23) + 6h + 40min + 10s, -77.85, 166.67, 271.34709, 0.39673, 1.003500},
      {sys_days(2031y / 12 / 21) + 4h, 23.4, 77.2, 135.81426, 27.73672, 0.983769},
      {sys_days(2039y / 8 / 5) + 15h + 20min, 45, 8.5, 258.50089, 35.02786, 1.014428},
  };
  for (const Row& row : rows) {
    const SunPosition sun = sun_position(row.utc, {row.latitude_deg, row.longitude_deg, 0, 15});
    const glm::dvec3 expected =
        direction_of(glm::radians(row.azimuth_deg), glm::radians(row.elevation_deg));
    EXPECT_LT(angle_deg(sun.direction, expected), 0.01) << row.latitude_deg;
    testing::record_margin("direction of the sun", angle_deg(sun.direction, expected), 0.01, "°");
    EXPECT_NEAR(sun.distance_au, row.distance_au, 1e-4);
  }
}

// Almanacs define sunrise by a centre 50' below the horizon: 16' of radius and 34' of refraction.
// At 45 degrees the refraction is 1' (its first term: 58" cot).
TEST(SunPosition, RefractionRaisesTheSun) {
  EXPECT_NEAR(glm::degrees(refraction_rad(glm::radians(-34. / 60), 1010, 10)) * 60, 34, 0.5);
  EXPECT_NEAR(glm::degrees(refraction_rad(pi / 4, 1010, 10)) * 60, 1, 0.03);
  EXPECT_EQ(refraction_rad(pi / 4, 0, 10), 0);
  EXPECT_EQ(refraction_rad(-pi / 4, 1010, 10), 0);
}

TEST(SunPosition, ErrorListsEveryFault) {
  EXPECT_THAT(
      [] {
        sun_position(sys_days(1492y / 10 / 12), {91, -361, 101325, 288});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("year 1492 must be in [1900, 2100]"),
                                 HasSubstr("latitude_deg = 91"), HasSubstr("longitude_deg = -361"),
                                 HasSubstr("pressure_hpa = 101325 must be in [0, 1100]: is "
                                           "it in Pa?"),
                                 HasSubstr("temperature_c = 288"))));
}

// 0.5332 degrees across at the mean distance: 9.31 mm of penumbra per metre from the edge.
TEST(Sun, DiscHasThePublishedDiameter) {
  const Sun sun = sun_at(0, 30);
  EXPECT_NEAR(glm::degrees(sun.angular_radius_rad()), 0.2666, 5e-5);
  EXPECT_NEAR(sun.solid_angle_sr(), pi * std::pow(sun.angular_radius_rad(), 2), 1e-9);
  const Sun far({.position = SunAngles{0, 30, 1.0167}}, {});  // aphelion
  EXPECT_NEAR(far.angular_radius_rad() / sun.angular_radius_rad(), 1 / 1.0167, 1e-6);
  EXPECT_NEAR(far.irradiance().g / sun.irradiance().g, std::pow(1.0167, -2), 1e-12);
}

// The vector irradiance of a cap of radius a and uniform radiance L is pi L sin^2 a along its axis,
// so a plane that faces the whole disc receives E cos theta for any profile of the disc.
TEST(Sun, IrradianceOfAPlaneFollowsTheCosine) {
  constexpr int rings = 400, sectors = 8;
  for (const SunDisc disc : {SunDisc::Uniform, SunDisc::LimbDarkened}) {
    for (const double elevation_deg : {1., 30., 90.}) {
      const Sun sun = sun_at(77, elevation_deg, disc);
      // `sample` is uniform in both numbers, so a grid of them is a quadrature over the disc. Near
      // the limb the brightness rises like a square root: the midpoint rule errs by about
      // rings^-1.5.
      glm::dvec3 sum(0);
      for (int i = 0; i < rings; ++i) {
        for (int k = 0; k < sectors; ++k) {
          const DirectionSample drawn = sun.sample({(i + 0.5) / rings, (k + 0.5) / sectors});
          EXPECT_NEAR(glm::length(drawn.direction), 1, 1e-14);
          EXPECT_EQ(sun.pdf_per_sr(drawn.direction), drawn.pdf_per_sr);
          sum += sun.radiance(drawn.direction) * drawn.direction.z / drawn.pdf_per_sr;
        }
      }
      const glm::dvec3 expected = sun.irradiance() * std::sin(glm::radians(elevation_deg));
      const double tolerance = disc == SunDisc::Uniform ? 1e-9 : 2 * std::pow(rings, -1.5);
      EXPECT_LT(glm::distance(sum / double{rings * sectors}, expected),
                tolerance * glm::length(expected))
          << elevation_deg;
    }
  }
}

TEST(Sun, DiscIsDarkBeyondItsLimb) {
  const Sun sun = sun_at(0, 45);
  const double radius = sun.angular_radius_rad();
  for (const double share : {0.999999, 1.000001}) {
    const glm::dvec3 d = direction_of(0, pi / 4 + share * radius);
    EXPECT_EQ(sun.pdf_per_sr(d) > 0, share < 1);
    EXPECT_EQ(sun.radiance(d).g > 0, share < 1);
  }
}

// As in every photograph of the sun.
TEST(Sun, LimbIsDarkerAndRedderThanTheCentre) {
  const Sun sun = sun_at(0, 45);
  const glm::dvec3 centre = sun.radiance(sun.direction());
  const glm::dvec3 limb = sun.radiance(direction_of(0, pi / 4 + 0.98 * sun.angular_radius_rad()));
  const glm::dvec3 ratio = limb / centre;
  EXPECT_GT(ratio.r, ratio.g);
  EXPECT_GT(ratio.g, ratio.b);
  EXPECT_GT(ratio.g, 0.4);
  EXPECT_LT(ratio.g, 0.6);
}

// Computed with spectrl2 of pvlib 0.16.1 (direct light, aerosols of the same depth): an independent
// implementation of the model. Six digits.
TEST(Sun, SpectrumMatchesBirdAndRiordan) {
  struct Row {
    double turbidity, elevation_deg, pressure_hpa, water_cm, ozone_cm, wavelength_nm, expected;
  };
  const Row rows[] = {
      {1, 90, 1013, 1.4164, 0.3438, 400, 1.02708},
      {1, 90, 1013, 1.4164, 0.3438, 905, 0.708813},
      {3, 48.2, 1013, 1.4164, 0.3438, 550, 1.21843},
      {3, 48.2, 1013, 1.4164, 0.3438, 860, 0.840766},
      {3, 48.2, 1013, 1.4164, 0.3438, 905, 0.590037},
      {3, 48.2, 1013, 1.4164, 0.3438, 1558, 0.238123},
      {2, 10, 850, 3, 0.25, 400, 0.114601},
      {2, 10, 850, 3, 0.25, 940, 0.0446979},
      {2, 10, 850, 3, 0.25, 1040, 0.519619},
      {2, 10, 850, 3, 0.25, 1558, 0.205925},
  };
  for (const Row& row : rows) {
    const Sun sun = sun_at(0, row.elevation_deg, SunDisc::Uniform,
                           {row.turbidity, row.water_cm, row.ozone_cm, row.pressure_hpa});
    EXPECT_NEAR(solar_irradiance_w_m2_nm(sun, row.wavelength_nm), row.expected, 1e-5 * row.expected)
        << row.wavelength_nm;
  }
}

// The direct spectrum of ASTM G173-03 (air mass 1.5, aerosols 0.084 at 500 nm), averaged over 20 nm
// at lidar wavelengths. It comes from a finer model, SMARTS 2.9.2: agreement within 8 %.
TEST(Sun, SpectrumAtLidarWavelengthsIsNearAstmG173) {
  const Sun sun = sun_at(180, 41.81, SunDisc::Uniform, {.turbidity = 1.735});
  EXPECT_NEAR(air_mass(sun.elevation_rad()), 1.5, 0.01);
  for (const auto& [wavelength_nm, expected] :
       {std::pair(532., 1.3485), {850., 0.9041}, {865., 0.8958}, {1064., 0.5896}, {1550., 0.2626}})
    EXPECT_NEAR(solar_irradiance_w_m2_nm(sun, wavelength_nm) / expected, 1, 0.08) << wavelength_nm;
}

// Kasten and Young (1989), table II: 38 on the horizon.
TEST(Sun, AirMassMatchesKastenAndYoung) {
  EXPECT_NEAR(air_mass(pi / 2), 1, 5e-4);
  EXPECT_NEAR(air_mass(glm::radians(30.)), 1.9943, 5e-5);
  EXPECT_NEAR(air_mass(glm::radians(10.)), 5.5860, 5e-5);
  EXPECT_NEAR(air_mass(0), 37.9196, 5e-5);
  EXPECT_EQ(air_mass(-0.1), air_mass(0));
}

TEST(Sun, BelowTheHorizonIsDark) {
  const Sun night = sun_at(10, -0.3);
  EXPECT_FALSE(night.is_up());
  EXPECT_EQ(night.irradiance(), glm::dvec3(0));
  EXPECT_EQ(night.radiance(night.direction()), glm::dvec3(0));
  EXPECT_EQ(night.sample({0.5, 0.5}).pdf_per_sr, 0);
  EXPECT_EQ(night.pdf_per_sr(night.direction()), 0);
  EXPECT_EQ(solar_irradiance_w_m2_nm(night, 905), 0);
  // The upper limb is still visible, and red.
  const Sun setting = sun_at(10, -0.2);
  EXPECT_TRUE(setting.is_up());
  EXPECT_GT(setting.irradiance().r, 5 * setting.irradiance().g);
}

TEST(Sun, ErrorListsEveryFault) {
  EXPECT_THAT(
      [] {
        sun_at(0, 30, SunDisc::Uniform, {0.5, 30, 343.8, 101325});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("turbidity = 0.5 must be in [1, 10]"),
                                 HasSubstr("water_cm = 30 must be in [0, 20]: is it in mi"),
                                 HasSubstr("ozone_cm = 343.8 must be in [0, 1]: is it in D"),
                                 HasSubstr("pressure_hpa = 101325"))));
  EXPECT_THAT(
      [] {
        Sun({.position = SunAngles{std::nan(""), 91, 1.5}}, {});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("azimuth_deg = nan"),
                                 HasSubstr("elevation_deg = 91 must be in [-90, 90]"),
                                 HasSubstr("distance_au = 1.5"))));
  EXPECT_THAT([] { solar_irradiance_w_m2_nm(sun_at(0, 30), 10'600); },
              ThrowsMessage<Error>("Sunlight: wavelength 10600 nm must be in [300, 4000]"));
}

}  // namespace
}  // namespace groundray::sun_test
