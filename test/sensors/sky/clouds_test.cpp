#include "sensors/sky/clouds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "sensors/sky/sky.h"

namespace groundray::clouds_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

SkySpec sky_with(const CloudSpec& clouds) {
  return {.dome = AnalyticSky{.clouds = clouds},
          .sun = SunSpec{.position = SunAngles{.azimuth_deg = 120, .elevation_deg = 40}}};
}

SkySpec clear_sky() {
  SkySpec spec = sky_with({});
  std::get<AnalyticSky>(spec.dome).clouds.reset();
  return spec;
}

// 40,000 places 4 km apart; the threshold is the quantile of 25,600 places next to each other,
// whose dependence makes it uncertain by about 0.02.
TEST(Clouds, CoverIsTheShareOfTheLayerWithClouds) {
  for (const double cover : {0.1, 0.35, 0.8}) {
    const Clouds clouds({.cover = cover, .variant = Seed{7}});
    int with = 0;
    for (int y = 0; y < 200; ++y) {
      for (int x = 0; x < 200; ++x)
        with += clouds.vertical_depth({4100.0 * x, 4300.0 * y}, 0) > 0 ? 1 : 0;
    }
    EXPECT_NEAR(with / 40'000.0, cover, 0.03);
  }
}

// The layer is a sphere about the earth's centre: the closed form of a direction's angle there.
TEST(Clouds, DirectionsCrossASphericalLayer) {
  const Clouds clouds({.cover = 1, .optical_depth = 2, .height_m = 2000});
  for (double elevation_deg = 0; elevation_deg <= 90; elevation_deg += 5) {
    const double elevation = elevation_deg * std::numbers::pi / 180;
    const auto crossing = clouds.cross({std::cos(elevation), 0, std::sin(elevation)}, 0);
    const double sine = 6371e3 * std::cos(elevation) / (6371e3 + 2000);
    EXPECT_NEAR(crossing.cosine, std::sqrt(1 - sine * sine), 1e-9) << elevation_deg;
    EXPECT_DOUBLE_EQ(crossing.depth(), 2 / crossing.cosine);
  }
}

TEST(Clouds, NoCloudsAreTheClearSky) {
  const Sky clear(clear_sky()), sky(sky_with({.cover = 0}));
  EXPECT_EQ(sky.sun()->irradiance(), clear.sun()->irradiance());
  for (double elevation = 0.1; elevation < 1.5; elevation += 0.1) {
    for (double azimuth = 0.05; azimuth < 6; azimuth += 0.3) {
      const glm::dvec3 direction(std::cos(elevation) * std::sin(azimuth),
                                 std::cos(elevation) * std::cos(azimuth), std::sin(elevation));
      if (glm::dot(direction, clear.sun()->direction()) > 0.99) continue;  // too steep for pixels
      const glm::dvec3 expected = clear.dome_radiance(direction);
      EXPECT_LT(glm::distance(sky.dome_radiance(direction), expected),
                2e-3 * glm::length(expected));
    }
  }
  EXPECT_LT(glm::distance(sky.dome_irradiance(), clear.dome_irradiance()),
            1e-3 * glm::length(clear.dome_irradiance()));
}

// Overcast of depth 30 lets no direct light through, and diffuse light by two streams: at a depth t
// below its top, the light is T(t) = 2 / (2 + (1 - g) t) of what falls on it. A direction of cosine
// m sees the mean of T over the optical depth x, with t = 30 - x m, and haze in front, from 1.5 km
// / m on. Each part of the path, about 2 deep, has the T of the mean depth that is seen.
TEST(Clouds, OvercastTransmitsByTwoStreams) {
  const Sky clear(clear_sky()), sky(sky_with({.cover = 1, .optical_depth = 30}));
  EXPECT_LT(glm::length(sky.sun()->irradiance()), 1e-15 * glm::length(clear.sun()->irradiance()));
  const glm::dvec3 falling =
      clear.dome_irradiance() + clear.sun()->irradiance() * clear.sun()->direction().z;
  for (const glm::dvec3& direction : {glm::dvec3(0, 0, 1), glm::dvec3(0.8, 0, 0.6)}) {
    double mean = 0;
    constexpr double dx = 1e-3;
    for (double x = dx / 2; x < 30; x += dx)
      mean += dx * std::exp(-x) * 2 / (2 + 0.15 * (30 - x * direction.z));
    const double near = std::exp(-1.52 / direction.z / 25);
    const glm::dvec3 expected = near * mean * falling / std::numbers::pi +
                                (1 - near) * (2 / (2 + 0.15 * 30)) * clear.dome_radiance(direction);
    const glm::dvec3 seen = sky.dome_radiance(direction);
    EXPECT_LT(glm::distance(seen, expected), 0.004 * glm::length(expected)) << direction.z;
  }
}

// What passes an overcast layer, with the sun's direct light, is T of what falls on it, less what
// the model loses between light that is not scattered yet and light that is scattered often: 0.12
// at most, where the depth is 1.
TEST(Clouds, OvercastPassesNoMoreLightThanFallsOnIt) {
  const Sky clear(clear_sky());
  const double up = clear.sun()->direction().z;
  const double falling = clear.dome_irradiance().g + clear.sun()->irradiance().g * up;
  for (const double depth : {0.01, 1.0, 10.0, 100.0}) {
    const Sky sky(sky_with({.cover = 1, .optical_depth = depth}));
    const double passed = (sky.dome_irradiance().g + sky.sun()->irradiance().g * up) / falling;
    const double streams = 2 / (2 + 0.15 * depth);
    EXPECT_LT(passed, streams + 1e-3) << depth;
    EXPECT_GT(passed, streams - 0.13) << depth;
  }
}

// Radiance of a layer for given light, in W/(m^2 sr), of the green channel.
double green(const Clouds& clouds, const glm::dvec3& direction, const glm::dvec3& sun,
             double clear_radiance) {
  return clouds
      .radiance(direction, 1e-3,
                {.sun = sun,
                 .sun_irradiance = glm::dvec3(1000),
                 .sky_irradiance = glm::dvec3(100),
                 .clear_radiance = glm::dvec3(clear_radiance)})
      .g;
}

// The same opaque clouds, seen with the sun behind the viewer and with the sun behind them. Bases
// are alike; the sides, at least a tenth of the directions, return more than they pass, at most
// (1 - T) / T = 2.2 times. A layer without sides would never be brighter away from the sun.
TEST(Clouds, SidesTowardsTheSunAreBright) {
  const Clouds clouds({.cover = 0.4, .variant = Seed{5}});
  const glm::dvec3 sun(0, std::sqrt(0.75), 0.5), opposite(0, -std::sqrt(0.75), 0.5);
  std::vector<double> ratios;
  for (double up = 0.2; up < 0.35; up += 0.005) {
    for (double turn = -0.5; turn < 0.5; turn += 0.005) {
      const double level = std::sqrt(1 - up * up);
      const glm::dvec3 south(level * std::sin(turn), -level * std::cos(turn), up);
      // Of a clear sky behind the cloud, only the haze in front is seen.
      if (green(clouds, south, sun, 1000) - green(clouds, south, sun, 0) > 300) continue;
      ratios.push_back(green(clouds, south, sun, 0) / green(clouds, south, opposite, 0));
    }
  }
  ASSERT_GT(ratios.size(), 500u);
  const auto bright = ratios.begin() + std::ssize(ratios) * 9 / 10;
  std::ranges::nth_element(ratios, bright);
  EXPECT_GT(*bright, 1.5);
}

// A cloud that is hardly there changes nothing, also far away, where haze hides it.
TEST(Clouds, RadianceIsContinuousAtEdges) {
  const glm::dvec3 sun(0, 0.8, 0.6);
  for (const double up : {0.0, 0.01, 0.1, 0.5, 1.0}) {
    const glm::dvec3 direction(std::sqrt(1 - up * up), 0, up);
    const Clouds thin({.cover = 0.999, .optical_depth = 1e-6});
    EXPECT_NEAR(green(thin, direction, sun, 100), 100, 1e-2) << up;
  }
}

TEST(Clouds, SunBehindCloudsIsDimmedByTheirDepth) {
  const SkySpec spec = sky_with({.cover = 1, .optical_depth = 1.5});
  const Sun clear(*spec.sun, spec.air), dimmed = sun_of(spec).value();
  const double cosine = Clouds({.cover = 1}).cross(clear.direction(), 0).cosine;
  EXPECT_NEAR(dimmed.irradiance().y, clear.irradiance().y * std::exp(-1.5 / cosine), 1e-9);
  EXPECT_NEAR(solar_irradiance_w_m2_nm(dimmed, 905),
              solar_irradiance_w_m2_nm(clear, 905) * std::exp(-1.5 / cosine), 1e-9);
}

TEST(Clouds, ErrorListsEveryFault) {
  EXPECT_THAT(
      [] {
        Clouds({.cover = 1.5, .optical_depth = -1, .height_m = 1, .thickness_m = 0, .size_m = 0});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("cover = 1.5"), HasSubstr("optical_depth = -1"),
                                 HasSubstr("height_m = 1"), HasSubstr("thickness_m = 0"),
                                 HasSubstr("size_m = 0"))));
}

}  // namespace
}  // namespace groundray::clouds_test
