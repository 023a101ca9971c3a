#include "sensors/sky/sky.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <numbers>
#include <random>

#include "core/error.h"
#include "core/image/luminance.h"
#include "sensors/sky/atmosphere.h"

namespace groundray::sky_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double pi = std::numbers::pi;

SkySpec clear(double elevation_deg, double turbidity = 3, double albedo = 0.2) {
  return {.dome = AnalyticSky{glm::dvec3(albedo)},
          .sun = SunSpec{.position = SunAngles{140, elevation_deg}},
          .air = {.turbidity = turbidity}};
}

// Mean of an estimate from samples of the dome, and its standard error.
struct Estimate {
  double mean, error;
};
Estimate from_draws(const Sky& sky, int count, const std::function<double(glm::dvec3)>& f) {
  std::mt19937_64 random(29);
  std::uniform_real_distribution<double> uniform(0, 1);
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    const double u = uniform(random);
    const DirectionSample drawn = sky.sample_dome({u, uniform(random)});
    EXPECT_NEAR(sky.dome_pdf_per_sr(drawn.direction), drawn.pdf_per_sr, 1e-7 * drawn.pdf_per_sr);
    const double value = f(drawn.direction) / drawn.pdf_per_sr;
    sum += value;
    squares += value * value;
  }
  const double mean = sum / count;
  return {mean, std::sqrt((squares / count - mean * mean) / count)};
}

// Computed with the sunsky plugin of Mitsuba 3.9.1 (scalar_rgb, sun_scale 0, times 106.7502594, the
// factor by which it divides), from the model's coefficients in single precision: 2e-6.
TEST(HosekWilkie, MatchesMitsuba) {
  struct Row {
    double turbidity, albedo, elevation_deg, azimuth_deg;
    glm::dvec3 direction, expected;
  };
  const Row rows[] = {
      {1, 0, 10, 0, {0.991170649, 0.082328971, 0.103935963}, {6.778171, 8.987976, 8.366674}},
      {1, 0, 10, 0, {-0.292681067, -0.515666118, 0.805249184}, {1.235343, 2.334378, 3.95527}},
      {3, 0.2, 45, 140, {0.405343156, -0.907247349, 0.112246043}, {18.80619, 25.24537, 32.19896}},
      {3, 0.2, 45, 140, {0.735503229, 0.468459146, 0.489470152}, {4.264174, 7.552536, 13.86812}},
      {2.3, 0.5, 3, 250, {0.440659838, 0.508318813, 0.739885728}, {1.319997, 1.833601, 2.205867}},
      {2.3, 0.5, 3, 250, {-0.096066011, -0.909965107, 0.403404047}, {2.764342, 3.398624, 3.484001}},
      {7.6, 0.8, 80, 30, {-0.465309955, -0.766882926, 0.442014958}, {11.9915, 16.16328, 23.50016}},
      {7.6, 0.8, 80, 30, {-0.181579003, 0.644096012, 0.743081014}, {15.87182, 19.36639, 25.04712}},
      {10, 1, 60, 300, {-0.766976457, -0.568009339, 0.298517178}, {30.33069, 30.97633, 32.47976}},
      {10, 1, 60, 300, {0.686396755, -0.188800933, 0.702291750}, {11.61486, 14.04507, 17.82054}},
  };
  for (const Row& row : rows) {
    const HosekWilkie sky(
        row.turbidity, glm::dvec3(row.albedo),
        direction_of(glm::radians(row.azimuth_deg), glm::radians(row.elevation_deg)));
    const glm::dvec3 radiance = sky.radiance(row.direction);
    for (int channel = 0; channel < 3; ++channel)
      EXPECT_NEAR(radiance[channel], row.expected[channel], 2e-6 * row.expected[channel]);
  }
}

TEST(HosekWilkie, ErrorListsEveryFault) {
  EXPECT_THAT(
      [] {
        HosekWilkie(11, {0, 0, 20}, direction_of(0, -0.1));
      },
      ThrowsMessage<Error>(AllOf(
          HasSubstr("turbidity = 11 must be in [1, 10]"),
          HasSubstr("ground_albedo[2] = 20 must be in [0, 1]: is it in percent?"),
          HasSubstr("the sun is 5.73 degrees below the horizon, but the model has no twilight"))));
  EXPECT_THAT(
      [] {
        HosekWilkie(3, glm::dvec3(0), {1, 1, 1});
      },
      ThrowsMessage<Error>(HasSubstr("must be of length 1")));
}

TEST(Sky, IrradianceOfAConstantSkyIsPiTimesItsRadiance) {
  const Sky sky({.dome = ConstantSky{{1, 2, 3}}});
  EXPECT_LT(glm::distance(sky.dome_irradiance(), pi * glm::dvec3(1, 2, 3)), 1e-14);
  // Over the sphere the estimate is exactly 4 pi L, as the density is constant; for a plane only
  // half of the samples contribute.
  EXPECT_NEAR(from_draws(sky, 100, [&](glm::dvec3 d) { return sky.radiance(d).g; }).mean, 8 * pi,
              1e-12);
  const Estimate plane =
      from_draws(sky, 100'000, [&](glm::dvec3 d) { return std::max(d.z, 0.) * sky.radiance(d).b; });
  EXPECT_NEAR(plane.mean, 3 * pi, 4 * plane.error);  // significance 6e-5
}

TEST(Sky, SunAddsItsDiscToTheDome) {
  const Sky sky({.dome = ConstantSky{{1, 1, 1}}, .sun = SunSpec{.position = SunAngles{90, 30}}});
  const glm::dvec3 to_sun = direction_of(pi / 2, pi / 6);
  ASSERT_TRUE(sky.sun());
  EXPECT_EQ(sky.radiance(to_sun), glm::dvec3(1) + sky.sun()->radiance(to_sun));
  EXPECT_EQ(sky.dome_radiance(to_sun), glm::dvec3(1));
  EXPECT_EQ(sky.radiance({0, 0, 1}), glm::dvec3(1));
  EXPECT_FALSE(Sky({}).sun());
}

TEST(Sky, ImageReplacesTheDome) {
  ImageF image(4, 2, 3);
  for (int x = 0; x < 4; ++x) image.at(x, 0)[0] = static_cast<float>(x + 1);
  const SkySpec spec{.dome = EnvironmentImage{"dome.exr", 90, IlluminanceScale{1e4}}};
  const Sky sky(spec, image);
  EXPECT_NEAR(683 * luminance(sky.dome_irradiance()), 1e4, 1e-8);
  const EnvironmentMap map(image, pi / 2, IlluminanceScale{1e4});
  const glm::dvec3 d = direction_of(1, 0.7);
  EXPECT_EQ(sky.dome_radiance(d), map.radiance(d));
  EXPECT_EQ(sky.dome_pdf_per_sr(d), map.pdf_per_sr(d));
  EXPECT_THAT([&] { Sky{spec}; }, ThrowsMessage<Error>(HasSubstr("'dome.exr' is missing")));
  EXPECT_THAT([&] { Sky({}, image); }, ThrowsMessage<Error>(HasSubstr("not an environment image")));
}

// Estimates from samples agree with the stored irradiance, which is a quadrature, and so does the
// test's own, finer quadrature.
TEST(Sky, IrradianceOfAClearSkyIsItsIntegral) {
  for (const double elevation_deg : {2., 20., 85.}) {
    const Sky sky(clear(elevation_deg));
    const double stored = luminance(sky.dome_irradiance());
    const Estimate drawn = from_draws(sky, 40'000, [&](glm::dvec3 d) {
      return std::max(d.z, 0.) * luminance(sky.dome_radiance(d));
    });
    EXPECT_NEAR(drawn.mean, stored, 4 * drawn.error) << elevation_deg;  // significance 6e-5
    EXPECT_LT(drawn.error, 0.01 * stored);
    constexpr int rings = 250, sectors = 300;
    double sum = 0;
    for (int i = 0; i < rings; ++i) {
      for (int k = 0; k < sectors; ++k) {
        const double elevation = pi / 2 * (i + 0.5) / rings;
        const glm::dvec3 d = direction_of(2 * pi * (k + 0.3) / sectors, elevation);
        sum += luminance(sky.dome_radiance(d)) * d.z * std::cos(elevation);
      }
    }
    EXPECT_NEAR(sum * pi * pi / (rings * sectors), stored, 2e-4 * stored) << elevation_deg;
  }
}

// Under a clear noon sky the sun provides about 100 000 lx and the sky 10 000 to 20 000 lx; turbid
// air moves light from the sun to the sky.
TEST(Sky, ClearNoonHasTheIlluminanceOfRealNoons) {
  const Sky sky(clear(60, 2.5)), hazy(clear(60, 6));
  const auto lux = [](const glm::dvec3& rgb) { return 683 * luminance(rgb); };
  EXPECT_GT(lux(sky.sun()->irradiance()), 80'000);
  EXPECT_LT(lux(sky.sun()->irradiance()), 110'000);
  EXPECT_GT(lux(sky.dome_irradiance()), 8'000);
  EXPECT_LT(lux(sky.dome_irradiance()), 25'000);
  EXPECT_LT(lux(hazy.sun()->irradiance()), lux(sky.sun()->irradiance()));
  EXPECT_GT(lux(hazy.dome_irradiance()), lux(sky.dome_irradiance()));
  EXPECT_GT(sky.dome_radiance({0, 0, 1}).b, 1.5 * sky.dome_radiance({0, 0, 1}).r);  // blue
}

// A Lambertian plain under the sky: radiance = albedo E / pi.
TEST(Sky, GroundReflectsSunAndSky) {
  const Sky sky(clear(30, 3, 0.4));
  const glm::dvec3 irradiance = sky.dome_irradiance() + sky.sun()->irradiance() * 0.5;
  EXPECT_LT(glm::distance(sky.dome_radiance({0, 0.6, -0.8}), 0.4 / pi * irradiance), 1e-12);
}

TEST(Sky, HorizonRadianceIsIndependentOfElevation) {
  const Sky sky(clear(30));
  const glm::dvec3 horizon = sky.dome_radiance({0, 1, 0});
  EXPECT_EQ(sky.horizon_radiance({0, 0.6, -0.8}), horizon);
  EXPECT_EQ(sky.horizon_radiance({0, 0.6, 0.8}), horizon);
  EXPECT_EQ(sky.horizon_radiance({0, 0, -1}), horizon);
}

TEST(Sky, AnalyticSkyNeedsASunAboveTheHorizon) {
  EXPECT_THAT([] { Sky({.dome = AnalyticSky{}}); },
              ThrowsMessage<Error>(HasSubstr("an analytic sky needs a sun")));
  EXPECT_THAT([] { Sky{clear(-4)}; },
              ThrowsMessage<Error>(HasSubstr("the sun is 4 degrees below the horizon")));
  const Sky night(
      {.dome = ConstantSky{{0, 0, 1e-6}}, .sun = SunSpec{.position = SunAngles{0, -4}}});
  EXPECT_EQ(night.radiance(direction_of(0, glm::radians(-4.))), glm::dvec3(0, 0, 1e-6));
}

TEST(Sky, RejectsNegativeAndNonFiniteConstantRadiance) {
  EXPECT_THAT(
      [] {
        Sky({.dome = ConstantSky{{-1, 0, std::nan("")}}});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("radiance[0] = -1 must be finite and >= 0"),
                                 HasSubstr("radiance[2] = nan"))));
}

// Koschmieder: at the visibility, 2 % of a black object's contrast against the horizon remains (ln
// 50 is 3.912 to 2e-5), at 550 nm, which is 0.9 nm from the green primary.
TEST(AerialPerspective, TwoPercentOfContrastRemainAtTheVisibility) {
  const AerialPerspective air({.visibility_m = 2000});
  const glm::dvec3 horizon(3, 4, 5);
  const glm::dvec3 seen = air.through(glm::dvec3(0), 2000, horizon);
  EXPECT_NEAR((horizon.g - seen.g) / horizon.g, 0.02, 1e-4);
  EXPECT_EQ(air.through({7, 8, 9}, 0, horizon), glm::dvec3(7, 8, 9));
  EXPECT_LT(glm::distance(air.through(glm::dvec3(0), 1e6, horizon), horizon), 1e-12);
  EXPECT_LT(glm::distance(air.through(horizon, 700, horizon), horizon), 1e-14);  // no contrast
  const AerialPerspective clear_air({.visibility_m = 20'000});
  EXPECT_GT(clear_air.extinction_per_m().b, clear_air.extinction_per_m().r);
  const AerialPerspective vacuum({});
  EXPECT_EQ(vacuum.through({1, 2, 3}, 1e5, horizon), glm::dvec3(1, 2, 3));
}

}  // namespace
}  // namespace groundray::sky_test
