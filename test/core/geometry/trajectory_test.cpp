#include "core/geometry/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/error.h"
#include "test/support/margin.h"

namespace groundray::trajectory_test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Pose of a car on a circle of radius r, turning left at a constant rate: the closed form of a
// constant twist.
Pose on_circle(double radius_m, double angle_rad) {
  return {rotation_from_yaw_pitch_roll(angle_rad, 0, 0),
          {radius_m * std::sin(angle_rad), radius_m * (1 - std::cos(angle_rad)), 1}};
}

TEST(Trajectory, FollowsACircleBetweenItsPoses) {
  const Trajectory X_AB(
      {{0s, on_circle(50, 0)}, {1s, on_circle(50, 0.4)}, {3s, on_circle(50, 1.2)}});
  for (int k = 0; k <= 300; ++k) {
    const Pose expected = on_circle(50, 0.004 * k);
    const Pose pose = X_AB.pose_at(10ms * k);
    EXPECT_LT(glm::length(pose.translation_m - expected.translation_m), 1e-12) << k;
    testing::record_margin("place on a circle",
                           glm::length(pose.translation_m - expected.translation_m), 1e-12, "m");
    EXPECT_NEAR(std::abs(glm::dot(pose.rotation, expected.rotation)), 1, 1e-15) << k;
  }
}

TEST(Trajectory, MountedSensorFollowsTheBody) {
  const Trajectory X_AB({{0s, on_circle(50, 0)}, {1s, on_circle(50, 0.4)}});
  const Pose X_BS{rotation_from_yaw_pitch_roll(0.3, -0.2, 0.1), {1, 2, 3}};
  const Trajectory X_AS = X_AB.mounted(X_BS);
  for (int k = 0; k <= 10; ++k) {
    const Pose expected = X_AB.pose_at(100ms * k) * X_BS;
    EXPECT_LT(glm::length(X_AS.pose_at(100ms * k).translation_m - expected.translation_m), 1e-12);
  }
}

TEST(Trajectory, RejectsTimesOutsideItsSpan) {
  const Trajectory X_AB({{1s, {}}, {2s, {}}});
  EXPECT_NO_THROW(X_AB.pose_at(2s));
  EXPECT_THAT([&] { X_AB.pose_at(2s + 1ns); },
              ThrowsMessage<Error>(
                  AllOf(HasSubstr("2.000000001 s"), HasSubstr("outside its span of [1, 2] s"))));
  EXPECT_THAT([&] { X_AB.pose_at(0s); },
              ThrowsMessage<Error>(HasSubstr("outside its span of [1, 2] s")));
}

TEST(Trajectory, ListsEveryBadPoseAtOnce) {
  EXPECT_THAT(
      ([] {
        Trajectory({{0s, {}}, {0s, {}}, {1s, {glm::dquat(1, 1, 0, 0), {}}}, {500ms, {}}});
      }),
      ThrowsMessage<Error>(AllOf(HasSubstr("pose 1 at 0 s is not later than pose 0"),
                                 HasSubstr("pose 2 has a quaternion of norm 1.414"),
                                 HasSubstr("pose 3 at 0.5 s is not later than pose 2 at 1 s"))));
  EXPECT_THAT([] { Trajectory({}); }, ThrowsMessage<Error>(HasSubstr("no pose")));
}

}  // namespace
}  // namespace groundray::trajectory_test
