#include "reconstruction/scan/range_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "test/support/beam_fan.h"

namespace groundray {
namespace {

using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

// Of 40 000 normal numbers the median is known to 0.8 % (one standard deviation), less for
// neighbours that share returns.
TEST(RangeNoise, IsFoundOnSmoothSurfaces) {
  std::mt19937_64 random(1);
  const BeamFan fan{.rings = 40,
                    .lowest_rad = -25 * degree,
                    .highest_rad = -5 * degree,
                    .columns = 1000,
                    .columns_per_turn = 1800};
  const RangeOf walls = nearer(plane_at({1, 0, 0}, 5), plane_at({-0.3, 1, 0}, 4));
  const RangeOf scene =
      nearer(nearer(plane_at({0, 0, -1}, 1.9), walls), [](const glm::dvec3&) { return 30.; });
  for (const double sd_m : {0.003, 0.02, 0.1}) {
    std::normal_distribution<double> normal(0, sd_m);
    ScanReturns fired = seen(fan, scene);
    for (glm::dvec3& p : fired.p_S) p += normal(random) * glm::normalize(p);
    EXPECT_NEAR(apparent_sd_m(organise(fired).scan) / sd_m, 1, 0.05);
  }
  EXPECT_LT(apparent_sd_m(organise(seen(fan, scene)).scan), 1e-4);
}

TEST(RangeNoise, JumpsAndGapsAreNone) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  const BeamFan fan{.rings = 20, .columns = 900, .columns_per_turn = 1800};
  OrganisedScan scan = organise(seen(fan, [](const glm::dvec3& towards) {
                         const double a = std::atan2(towards.y, towards.x);
                         return std::lround(a * 40) % 3 == 0 ? 4. : 9.;
                       })).scan;
  for (glm::dvec3& p : scan.points_m) {
    if (uniform(random) < 0.2) p = glm::dvec3(std::numeric_limits<double>::quiet_NaN());
  }
  EXPECT_LT(apparent_sd_m(scan), 1e-3);
}

TEST(RangeNoise, OfNothingIsZero) {
  EXPECT_EQ(apparent_sd_m({}), 0);
  EXPECT_EQ(apparent_sd_m(organise(seen({.rings = 2, .columns = 2}, plane_at({1, 0, 0}, 3))).scan),
            0);
}

}  // namespace
}  // namespace groundray
