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

// Overcast of depth 30 lets no direct light through, and diffuse light by two streams:
// T = 2 / (2 + (1 - g) depth). What comes down is T times what falls on the layer, less
// exp(-1.66 depth) = 2e-22 of it, and single scattering; its radiance is the same in all
// directions.
TEST(Clouds, OvercastTransmitsByTwoStreams) {
  const Sky clear(clear_sky()), sky(sky_with({.cover = 1, .optical_depth = 30}));
  EXPECT_LT(glm::length(sky.sun()->irradiance()), 1e-15 * glm::length(clear.sun()->irradiance()));
  const glm::dvec3 falling =
      clear.dome_irradiance() + clear.sun()->irradiance() * clear.sun()->direction().z;
  const glm::dvec3 expected = falling * (2 / (2 + 0.15 * 30));
  EXPECT_LT(glm::distance(sky.dome_irradiance(), expected), 1e-3 * glm::length(expected));
  const glm::dvec3 zenith = sky.dome_radiance({0, 0, 1}), low = sky.dome_radiance({0.8, 0, 0.6});
  EXPECT_LT(glm::distance(zenith, expected / std::numbers::pi), 1e-3 * glm::length(zenith));
  EXPECT_LT(glm::distance(zenith, low), 1e-5 * glm::length(zenith));
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
  EXPECT_THAT([] { Clouds({.cover = 1.5, .optical_depth = -1, .height_m = 1, .size_m = 0}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("cover = 1.5"), HasSubstr("optical_depth = -1"),
                                         HasSubstr("height_m = 1"), HasSubstr("size_m = 0"))));
}

}  // namespace
}  // namespace groundray::clouds_test
