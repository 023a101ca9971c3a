#include "terrain/ground_path.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/geometry/pose.h"

namespace groundray::ground_path_test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr int side_samples = 101;
constexpr double east_slope = 0.25;     // slopes of the plane
constexpr double north_slope = -0.125;  // both exact in float, as are all heights

double plane_m(double x, double y) { return 10 + east_slope * x + north_slope * y; }

// 100 m x 100 m, centred on D's origin, spacing 1 m, north up.
HeightGrid ground_of(auto height_m) {
  std::vector<float> heights;
  for (int row = 0; row < side_samples; ++row) {
    for (int column = 0; column < side_samples; ++column) {
      heights.push_back(static_cast<float>(height_m(column - 50.0, 50.0 - row)));
    }
  }
  return HeightGrid({side_samples, side_samples}, {-50, 50}, {1, -1}, heights);
}

HeightGrid tilted_plane() { return ground_of(plane_m); }
HeightGrid flat() {
  return ground_of([](double, double) { return 0; });
}

GroundPathSpec bends() {
  return {.waypoints_m = {{-40, -30}, {-10, -35}, {5, 0}, {-20, 12}, {-15, 40}, {30, 20}},
          .speed_m_s = 5,
          .height_m = 0.5,
          .duration = 20s};
}

std::string error_of(const HeightGrid& ground, const GroundPathSpec& spec) {
  try {
    build_ground_path(ground, spec);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(GroundPath, StraightPathIsUniformMotion) {
  const Trajectory path = build_ground_path(
      flat(), {.waypoints_m = {{1, 2}, {31, 42}}, .speed_m_s = 5, .height_m = 2, .duration = 10s});
  EXPECT_EQ(path.begin_time(), 0ns);
  EXPECT_EQ(path.end_time(), 10s);
  EXPECT_EQ(path.samples().size(), 1001u);
  for (const auto& [time, X_DB] : path.samples()) {
    const double t_s = std::chrono::duration<double>(time).count();
    EXPECT_LT(glm::distance(X_DB.translation_m, glm::dvec3(1 + 3 * t_s, 2 + 4 * t_s, 2)), 1e-12);
    EXPECT_LT(glm::distance(X_DB.rotation * glm::dvec3(1, 0, 0), glm::dvec3(0.6, 0.8, 0)), 1e-15);
  }
}

TEST(GroundPath, LastPoseIsAtTheEndOfTheDuration) {
  const Trajectory path =
      build_ground_path(flat(), {.waypoints_m = {{0, 0}, {10, 0}}, .duration = 123456789ns});
  EXPECT_EQ(path.end_time(), 123456789ns);
  EXPECT_EQ(path.samples().size(), 14u);
  EXPECT_NEAR(path.samples().back().pose.translation_m.x, 0.123456789, 1e-15);
}

// On a plane the body's axes are known without angles: z is the normal, and x is the heading
// projected vertically onto the plane.
TEST(GroundPath, BodyIsParallelToATiltedPlane) {
  const glm::dvec3 normal = glm::normalize(glm::dvec3(-east_slope, -north_slope, 1));
  constexpr double tolerance = 1e-13;  // a few roundings of slopes over 2 m, from heights near 20 m
  const Trajectory path = build_ground_path(tilted_plane(), bends());
  for (const auto& [time, X_DB] : path.samples()) {
    const glm::dvec3 p = X_DB.translation_m;
    EXPECT_NEAR(p.z, plane_m(p.x, p.y) + 0.5, tolerance * 50);
    EXPECT_LT(glm::distance(X_DB.rotation * glm::dvec3(0, 0, 1), normal), tolerance);
    EXPECT_NEAR(glm::dot(X_DB.rotation * glm::dvec3(1, 0, 0), normal), 0, tolerance);
  }
}

TEST(GroundPath, PitchAndRollOnATiltedPlaneMatchTheClosedForm) {
  // The ground rises to the east, which is ahead, by 1/4: the nose is up, a negative pitch. It
  // falls to the north, which is left, by 1/8: the left side is down, a negative roll.
  const Trajectory path =
      build_ground_path(tilted_plane(), {.waypoints_m = {{0, 0}, {20, 0}}, .duration = 10s});
  const double pitch_rad = -std::atan(0.25);
  const double roll_rad = std::atan(-0.125 * std::cos(std::atan(0.25)));
  const glm::dquat expected = rotation_from_yaw_pitch_roll(0, pitch_rad, roll_rad);
  EXPECT_NEAR(std::abs(glm::dot(path.pose_at(5s).rotation, expected)), 1, 1e-15);
  const glm::dvec3 nose = path.pose_at(5s).rotation * glm::dvec3(1, 0, 0);
  const glm::dvec3 left = path.pose_at(5s).rotation * glm::dvec3(0, 1, 0);
  EXPECT_GT(nose.z, 0.2);
  EXPECT_LT(left.z, -0.1);
}

TEST(GroundPath, PitchAndRollFollowTheWheelsNotTheCentre) {
  // A ridge along x = 0, 1 m high and 2 m wide, under the centre of a vehicle whose wheels stand on
  // the flat ground.
  const HeightGrid ridge =
      ground_of([](double x, double) { return std::max(0.0, 1 - std::abs(x)); });
  const Pose X_DB =
      build_ground_path(ridge,
                        {.waypoints_m = {{0, 0}, {10, 0}}, .footprint_m = {4, 1}, .duration = 1s})
          .samples()
          .front()
          .pose;
  EXPECT_EQ(X_DB.translation_m, glm::dvec3(0, 0, 1));
  EXPECT_EQ(X_DB.rotation, glm::dquat(1, 0, 0, 0));
}

// On a curve of radius r, the chord of an arc s is shorter than s by s^3 / (24 r^2); the sharpest
// bend here has r > 1 m.
TEST(GroundPath, HorizontalSpeedIsConstant) {
  constexpr double step_m = 5 * 0.01;
  const auto samples = build_ground_path(flat(), bends()).samples();
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double chord_m =
        glm::distance(samples[i - 1].pose.translation_m, samples[i].pose.translation_m);
    EXPECT_LT(chord_m, step_m + 1e-12);
    EXPECT_GT(chord_m, step_m - step_m * step_m * step_m / 24);
  }
}

// Poses are 5 cm apart, so one of them lies within 2.5 cm of each waypoint along the curve.
TEST(GroundPath, PassesThroughWaypointsInOrderAlongTheBisector) {
  GroundPathSpec spec = bends();
  spec.duration = 33s;
  const auto samples = build_ground_path(flat(), spec).samples();
  std::size_t next = 0;
  for (std::size_t i = 0; i + 1 < spec.waypoints_m.size(); ++i) {
    const glm::dvec3 waypoint(spec.waypoints_m[i], 0.5);
    while (next < samples.size() &&
           glm::distance(samples[next].pose.translation_m, waypoint) > 0.0251)
      ++next;
    ASSERT_LT(next, samples.size()) << "waypoint " << i;
    if (i == 0) continue;
    // The spacing of the knots makes the tangent at a waypoint bisect the chords; within 2.5 cm it
    // turns by at most 0.05 rad.
    const glm::dvec2 in = glm::normalize(spec.waypoints_m[i] - spec.waypoints_m[i - 1]);
    const glm::dvec2 out = glm::normalize(spec.waypoints_m[i + 1] - spec.waypoints_m[i]);
    const glm::dvec3 heading = samples[next].pose.rotation * glm::dvec3(1, 0, 0);
    EXPECT_LT(glm::distance(heading, glm::dvec3(glm::normalize(in + out), 0)), 0.05);
  }
}

TEST(GroundPath, HeadingIsTheDirectionOfMotion) {
  const auto samples = build_ground_path(flat(), bends()).samples();
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    const glm::dvec3 moved = samples[i + 1].pose.translation_m - samples[i - 1].pose.translation_m;
    // The error of a central difference is of second order in the step: a sixth of the derivative
    // of curvature times the squared step.
    EXPECT_LT(glm::distance(glm::normalize(moved), samples[i].pose.rotation * glm::dvec3(1, 0, 0)),
              2e-3);
  }
}

TEST(GroundPath, ErrorListsEveryFault) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string message = error_of(flat(), {.waypoints_m = {{0, 0}, {0, 0.001}, {nan, 1}},
                                                .speed_m_s = 0,
                                                .height_m = nan,
                                                .footprint_m = {0, 1}});
  EXPECT_THAT(message, HasSubstr("ground path:"));
  EXPECT_THAT(message, HasSubstr("waypoints_m[1] is 0.001 m from the previous one"));
  EXPECT_THAT(message, HasSubstr("waypoints_m[2] = (nan, 1) must be finite"));
  EXPECT_THAT(message, HasSubstr("speed_m_s = 0 must be positive"));
  EXPECT_THAT(message, HasSubstr("height_m = nan must be finite"));
  EXPECT_THAT(message, HasSubstr("footprint_m = [0, 1]"));
  EXPECT_THAT(message, HasSubstr("the duration, 0 s, must be positive"));
  EXPECT_THAT(error_of(flat(), {.waypoints_m = {{0, 0}}, .duration = 1s}),
              HasSubstr("waypoints_m has 1 point"));
}

TEST(GroundPath, RejectsADriveLongerThanTheCurve) {
  EXPECT_THAT(error_of(flat(), {.waypoints_m = {{0, 0}, {30, 0}}, .speed_m_s = 2, .duration = 20s}),
              HasSubstr("is 30.000 m long, but 20 s at 2 m/s cover 40.000 m"));
}

TEST(GroundPath, RejectsAReversalAtAWaypoint) {
  EXPECT_THAT(error_of(flat(), {.waypoints_m = {{0, 0}, {30, 0}, {10, 0}}, .duration = 1s}),
              HasSubstr("reverses at waypoints_m[1] = (30, 0)"));
}

TEST(GroundPath, ReportsWheelTimeAndPositionOutsideTheDem) {
  // The front wheels are half a wheel base, 1 m, ahead of the centre: the DEM ends at x = 50 when
  // the centre passes 49.
  const std::string message =
      error_of(flat(), {.waypoints_m = {{40, 0}, {60, 0}}, .duration = 15s});
  EXPECT_THAT(message, HasSubstr("at 9.01 s the vehicle's front left wheel would stand outside the "
                                 "DEM at (50.010, 0.750) m"));
}

TEST(GroundPath, ReportsWheelTimeAndPositionInAHole) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const HeightGrid holed =
      ground_of([](double x, double y) { return x == 10 && y == -1 ? nan : 0; });
  EXPECT_THAT(error_of(holed, {.waypoints_m = {{0, 0}, {20, 0}}, .duration = 15s}),
              HasSubstr("s the vehicle's front right wheel would stand in a hole of the DEM at ("));
}

}  // namespace
}  // namespace groundray::ground_path_test
