#include "reconstruction/dem/measured_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "core/random.h"
#include "reconstruction/dem/fusion/packed_point.h"

namespace groundray::measured_points_test {
namespace {

// Errors are drawn along a line of sight and across it, and the distances of the points from planes
// are measured. A variance of 40,000 draws scatters by 0.7 %: five times that. The remaining
// position error is stated as the mean over both directions, so the effects on two slopes of equal
// rise at right angles are added.
TEST(PointErrors, MatchDistancesOfDrawnPointsFromPlanes) {
  constexpr int draws = 40'000;
  constexpr double along_sd_m = 0.1, across_sd_m = 0.01;
  for (const double dip_rad : {0.1, 0.4, 1.2}) {
    const glm::dvec3 sight(std::cos(dip_rad), 0, -std::sin(dip_rad));
    const glm::dmat3 covariance_m2 =
        glm::dmat3(across_sd_m * across_sd_m) +
        (along_sd_m * along_sd_m - across_sd_m * across_sd_m) * glm::outerProduct(sight, sight);
    const PointErrors errors = point_errors(covariance_m2);
    for (const double slope : {-0.5, -0.1, 0.0, 0.3, 0.8}) {
      double sum_m2 = 0;
      for (std::uint32_t i = 0; i < draws; ++i) {
        const double along = random_normal({.seed = {3}, .pulse = i}).x;
        const glm::dvec2 across = random_normal({.seed = {3}, .sensor = 1, .pulse = i});
        const glm::dvec3 off_m = along_sd_m * along * sight +
                                 across_sd_m * (across.x * glm::dvec3(sight.z, 0, -sight.x) +
                                                across.y * glm::dvec3(0, 1, 0));
        sum_m2 += std::pow(off_m.z - slope * off_m.x, 2) + std::pow(off_m.z - slope * off_m.y, 2);
      }
      const glm::dvec2 tilt = 1.0 - slope * glm::dvec2(errors.lean);
      const double told_m2 = std::pow(errors.sd_m, 2) * glm::dot(tilt, tilt) +
                             2 * std::pow(slope * double{errors.across_sd_m}, 2);
      EXPECT_NEAR(told_m2 / (sum_m2 / draws), 1, 0.036) << dip_rad << ", " << slope;
    }
  }
}

TEST(PointErrors, LevelSightLimitsTheLeanAndStatesTheRestInPlan) {
  const PointErrors level = point_errors({{0.01, 0, 0}, {0, 0.0004, 0}, {0, 0, 0}});
  EXPECT_EQ(level.sd_m, 0);
  EXPECT_EQ(level.lean, glm::vec2(0));
  EXPECT_NEAR(level.across_sd_m, std::sqrt(0.0104 / 2), 1e-8);
  // 1 m in plan along x per 1 mm of height: the lean takes 60 mm of it, and 0.94 m remain along x.
  const PointErrors grazing = point_errors({{1, 0, 1e-3}, {0, 0, 0}, {1e-3, 0, 1e-6}});
  EXPECT_NEAR(grazing.lean.x, MeasuredPoints::most_lean, 1e-4);
  EXPECT_EQ(grazing.lean.y, 0);
  EXPECT_NEAR(grazing.across_sd_m, std::sqrt(0.94 * 0.94 / 2), 1e-6);
}

// 11 bits behind the leading one: half a unit of 2^-11.
TEST(PackedLean, RoundsToOnePartIn4096) {
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const glm::dvec2 dice = random_uniform({.seed = {5}, .pulse = i});
    const auto value =
        static_cast<float>(std::exp2(-9.9 + 15.8 * dice.x) * (dice.y < 0.5 ? -1 : 1));
    EXPECT_NEAR(unpacked_lean(packed_lean(value)), value, std::abs(value) / 4096);
  }
  for (const float small : {0.F, -0.F, 1e-5F, -9e-4F}) EXPECT_EQ(packed_lean(small), 0);
  EXPECT_NEAR(unpacked_lean(packed_lean(-60.F)), -60, 60. / 4096);
  EXPECT_NEAR(unpacked_lean(packed_lean(1e9F)), 64, 64. / 2048);
}

}  // namespace
}  // namespace groundray::measured_points_test
