#include "sensors/sky/clouds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

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

// 40,000 places 4 km apart, which are independent: standard deviation 0.0025 at most; the threshold
// itself is the quantile of 25,600 dependent places.
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
// m sees the mean of T over the optical depth x, with t = 30 - x m, and haze in front. Parts of the
// path are 1.5 / m deep and have the T of their middle, although their front counts more: 1 %.
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
    const double near = std::exp(-1.515 / direction.z / 25);
    const glm::dvec3 expected = near * mean * falling / std::numbers::pi +
                                (1 - near) * (2 / (2 + 0.15 * 30)) * clear.dome_radiance(direction);
    const glm::dvec3 seen = sky.dome_radiance(direction);
    EXPECT_LT(glm::distance(seen, expected), 1.2e-2 * glm::length(expected));
  }
  // The layer as a whole passes T of what falls on it; haze and the slope of T within the depth
  // that is seen, 0.15 / 6.5 of it, change that.
  const glm::dvec3 passed = falling * (2 / (2 + 0.15 * 30));
  EXPECT_LT(glm::distance(sky.dome_irradiance(), passed), 0.07 * glm::length(passed));
}

// Clouds to the north are seen in front of the sun, those to the south lit by it: their sides are
// brighter than their bases are above, but no brighter than white, i.e. E / pi and forward
// scattering.
TEST(Clouds, SidesTowardsTheSunAreBright) {
  const SkySpec spec{.dome = AnalyticSky{.clouds = CloudSpec{.cover = 0.4, .variant = Seed{5}}},
                     .sun = SunSpec{.position = SunAngles{.azimuth_deg = 0, .elevation_deg = 35}}};
  const Sky sky(spec), clear([&] {
    SkySpec without = spec;
    std::get<AnalyticSky>(without.dome).clouds.reset();
    return without;
  }());
  const auto brightest = [&](double low_deg, double high_deg, double side) {
    double most = 0;
    for (double elevation_deg = low_deg; elevation_deg < high_deg; elevation_deg += 0.4) {
      for (double azimuth_deg = -60; azimuth_deg < 60; azimuth_deg += 0.4) {
        const double up = elevation_deg * std::numbers::pi / 180;
        const double turn = azimuth_deg * std::numbers::pi / 180;
        const glm::dvec3 direction(std::cos(up) * std::sin(turn),
                                   side * std::cos(up) * std::cos(turn), std::sin(up));
        most = std::max(most, sky.dome_radiance(direction).g);
      }
    }
    return most;
  };
  const double white =
      (clear.sun()->irradiance().g * clear.sun()->direction().z + clear.dome_irradiance().g) /
      std::numbers::pi;
  const double lit = brightest(12, 30, -1), base = white * 2 / (2 + 0.15 * 30);
  EXPECT_GT(lit, 2 * base);
  EXPECT_LT(lit, 1.1 * white);
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
