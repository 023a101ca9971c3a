#include "core/geometry/pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/ext/matrix_double4x4.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <numbers>

#include "core/random.h"
#include "test/support/margin.h"

namespace groundray::pose_test {
namespace {

Pose random_pose(std::uint32_t number, double reach_m) {
  const auto at = [&](std::uint32_t k) { return random_normal({Seed{1}, k, 0, number}); };
  return {glm::normalize(glm::dquat(at(0).x, at(0).y, at(1).x, at(1).y)),
          glm::dvec3(at(2), at(3).x) * reach_m};
}

// Largest distance between the images of a point under two poses, over points within a metre of the
// origin, metres.
double distance_m(const Pose& a, const Pose& b) {
  double worst = 0;
  for (const glm::dvec3& p :
       {glm::dvec3(0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)}) {
    worst = std::max(worst, glm::length(a * p - b * p));
  }
  return worst;
}

// Exponential of the twist (v, w) as the power series of its 4 x 4 matrix: independent of the
// closed form.
Pose exponential(const glm::dvec3& v, const glm::dvec3& w) {
  const glm::dmat4 twist = glm::transpose(
      glm::dmat4(0, -w.z, w.y, v.x, w.z, 0, -w.x, v.y, -w.y, w.x, 0, v.z, 0, 0, 0, 0));
  glm::dmat4 sum(1);
  glm::dmat4 term(1);
  for (int k = 1; k < 60; ++k) {
    term = term * twist * (1.0 / k);
    sum += term;
  }
  return {glm::quat_cast(glm::dmat3(sum)), glm::dvec3(sum[3])};
}

TEST(Pose, ProductTransformsPointsThroughBothFrames) {
  for (std::uint32_t i = 0; i < 100; ++i) {
    const Pose X_AB = random_pose(2 * i, 10);
    const Pose X_BC = random_pose(2 * i + 1, 10);
    const glm::dvec3 p_CQ(1, -2, 3);
    EXPECT_LT(glm::length((X_AB * X_BC) * p_CQ - X_AB * (X_BC * p_CQ)),
              1e-13 * 50);  // a few ulps of 50 m
    EXPECT_LT(distance_m(inverse(X_AB) * X_AB, Pose{}), 1e-13 * 50);
  }
}

TEST(Pose, YawTurnsLeftPitchLowersTheNoseRollLowersTheRight) {
  const double quarter = std::numbers::pi / 2;
  const auto turned = [](double yaw, double pitch, double roll, const glm::dvec3& p) {
    return rotation_from_yaw_pitch_roll(yaw, pitch, roll) * p;
  };
  EXPECT_LT(glm::length(turned(quarter, 0, 0, {1, 0, 0}) - glm::dvec3(0, 1, 0)), 1e-15);
  EXPECT_LT(glm::length(turned(0, quarter, 0, {1, 0, 0}) - glm::dvec3(0, 0, -1)), 1e-15);
  EXPECT_LT(glm::length(turned(0, 0, quarter, {0, -1, 0}) - glm::dvec3(0, 0, -1)), 1e-15);
  EXPECT_LT(glm::length(turned(quarter, quarter, 0, {1, 0, 0}) - glm::dvec3(0, 0, -1)), 1e-15);
}

// About one axis, half of an angle; q and -q are the same rotation.
TEST(Pose, HalfWayIsHalfTheAngleForBothSignsOfAQuaternion) {
  const glm::dquat before = rotation_from_yaw_pitch_roll(0.3, 0, 0),
                   after = rotation_from_yaw_pitch_roll(1.5, 0, 0),
                   middle = rotation_from_yaw_pitch_roll(0.9, 0, 0);
  for (const glm::dquat& other : {after, -after}) {
    const glm::dquat found = half_way_between(before, other);
    EXPECT_NEAR(std::abs(glm::dot(found, middle)), 1, 1e-15);
    EXPECT_NEAR(glm::length(found), 1, 1e-15);
  }
}

TEST(Screw, FollowsTheExponentialOfItsTwist) {
  for (std::uint32_t i = 0; i < 200; ++i) {
    const glm::dvec3 v = random_pose(i, 3).translation_m;
    glm::dvec3 w = random_pose(1000 + i, 1).translation_m;
    w *= std::min(1.0, 3.0 / glm::length(w));  // less than half a turn
    if (i % 10 == 0) w *= 1e-9;
    const Screw screw(exponential(v, w));
    for (const double s : {0.0, 0.25, 0.5, 1.0, 1.5}) {
      EXPECT_LT(distance_m(screw.at(s), exponential(v * s, w * s)), 1e-12) << i << " at " << s;
      testing::record_margin("pose", distance_m(screw.at(s), exponential(v * s, w * s)), 1e-12,
                             "m");
    }
  }
}

TEST(Screw, TranslationIsLinear) {
  const Screw screw({glm::dquat(1, 0, 0, 0), {2, -4, 6}});
  EXPECT_EQ(screw.at(0.5).translation_m, glm::dvec3(1, -2, 3));
  EXPECT_EQ(screw.at(0.5).rotation, glm::dquat(1, 0, 0, 0));
}

}  // namespace
}  // namespace groundray::pose_test
