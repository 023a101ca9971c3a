#include "terrain/assets/figure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "core/geometry/height_grid.h"
#include "terrain/ground.h"
#include "test/terrain/assets/walking.h"

namespace groundray::figure_test {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using walking::bumps;
using walking::flat;
using walking::part_point;
using walking::PartPoint;
using walking::slope;
using walking::straight;
using walking::walk_on;

// Numbers of the parts of a person, and segments as published: fractions of stature of Drillis and
// Contini (1966).
constexpr std::size_t head = 2, thigh_l = 7, shank_l = 9, foot_l = 11, toes_l = 13;
constexpr double thigh = 0.245, shank = 0.246, ankle = 0.039, foot_length = 0.152;
constexpr double stature_m = 1.8, speed_m_s = 1.38;

std::vector<Trajectory> person_on(const HeightGrid& ground, double m_s = speed_m_s,
                                  nanoseconds spacing = 5ms) {
  return walk_on(ground, {.kind = AssetKind::Person, .size_m = stature_m}, straight(ground, m_s),
                 spacing);
}

// Heel, ball and tip of the toes.
std::array<PartPoint, 3> sole(const std::vector<Trajectory>& person, std::size_t side,
                              nanoseconds time) {
  constexpr double heel = -0.039, ball = 0.072;
  const Trajectory& foot = person[foot_l + side];
  return {part_point(foot, stature_m * glm::dvec3(heel, 0, -ankle), time),
          part_point(foot, stature_m * glm::dvec3(ball, 0, -ankle), time),
          part_point(person[toes_l + side], stature_m * glm::dvec3(heel + foot_length - ball, 0, 0),
                     time)};
}

double angle_deg(const Trajectory& part, nanoseconds time) {  // of a bone, forward of the vertical
  const glm::dvec3 down = part.pose_at(time).rotation * glm::dvec3(0, 0, -1);
  return std::atan2(down.x, -down.z) * 180 / std::numbers::pi;
}

// Time of a landing of the left foot, in the middle of the walk: its heel begins to stand.
nanoseconds landing(const std::vector<Trajectory>& person, nanoseconds from) {
  bool was_fast = false;
  for (nanoseconds time = from;; time += 1ms) {
    const PartPoint heel = sole(person, 0, time)[0];
    const bool stands = heel.m_s < 0.05 && std::abs(heel.p.z) < 1e-3;
    if (was_fast && stands) return time;
    was_fast = !stands;
  }
}

TEST(Figure, AFootThatBearsWeightStandsStillOnTheGround) {
  // The sole is a plane: it sinks into bumps, by 0.15 m (1 m / 2)^2 / 2 at the most.
  for (const auto& [grid, sinks_m] :
       {std::pair(flat(), 0.002), std::pair(slope(), 0.002), std::pair(bumps(), 0.02)}) {
    const Ground ground(grid);
    const auto person = person_on(grid);
    for (nanoseconds time = 2500us; time < 5s; time += 5ms) {
      double slowest_m_s = 1e9, lowest_m = 1e9;
      for (std::size_t side = 0; side < 2; ++side) {
        for (const PartPoint& point : sole(person, side, time)) {
          const double above_m = point.p.z - *ground.height_m_at(glm::dvec2(point.p));
          lowest_m = std::min(lowest_m, above_m);
          if (std::abs(above_m) < 0.025) slowest_m_s = std::min(slowest_m_s, point.m_s);
        }
      }
      // The poses between samples deviate by at most 2 mm; see DeviatesLittleBetweenPoses.
      EXPECT_LT(slowest_m_s, 0.02) << time.count();
      EXPECT_GT(lowest_m, -sinks_m) << time.count();
    }
  }
}

TEST(Figure, BonesKeepTheirPublishedLengths) {
  const auto person = person_on(bumps());
  for (nanoseconds time = 0s; time <= 5s; time += 5ms) {
    for (std::size_t side = 0; side < 2; ++side) {
      const auto joint = [&](std::size_t part) {
        return person[part + side].pose_at(time).translation_m;
      };
      EXPECT_NEAR(glm::distance(joint(thigh_l), joint(shank_l)), thigh * stature_m, 1e-9);
      EXPECT_NEAR(glm::distance(joint(shank_l), joint(foot_l)), shank * stature_m, 2e-6);
    }
  }
}

// Knee flexion every 4 % of the stride: Schwartz, Rozumalski and Trost, J. Biomech. 41 (2008), free
// speed. Thigh: hip flexion of Perry and Burnfield, Gait Analysis (2010), less 10 degrees of
// pelvic tilt. The differences are those that standing feet and given bones require.
TEST(Figure, JointAnglesFollowPublishedGait) {
  constexpr std::array<double, 25> knee_deg = {5.5,  11.0, 17.2, 19.7, 18.9, 16.9, 14.5, 12.0, 9.8,
                                               7.9,  6.8,  7.1,  9.5,  14.4, 22.6, 34.1, 47.0, 56.8,
                                               60.5, 58.2, 50.8, 39.5, 26.0, 12.6, 4.5};
  constexpr std::array<std::array<double, 2>, 7> thigh_deg = {
      {{0, 20}, {0.10, 15}, {0.30, 0}, {0.50, -20}, {0.62, -15}, {0.75, 15}, {0.85, 22}}};
  const auto person = person_on(flat());
  const nanoseconds begin = landing(person, 1s), end = landing(person, begin + 200ms);
  const auto at = [&](double phase) {
    return begin +
           nanoseconds(static_cast<long>(phase * static_cast<double>((end - begin).count())));
  };
  double knee_squares = 0, most_knee_deg = 0, thigh_squares = 0;
  for (std::size_t i = 0; i < knee_deg.size(); ++i) {
    const double knee = angle_deg(person[thigh_l], at(0.04 * static_cast<double>(i))) -
                        angle_deg(person[shank_l], at(0.04 * static_cast<double>(i)));
    knee_squares += (knee - knee_deg[i]) * (knee - knee_deg[i]);
    most_knee_deg = std::max(most_knee_deg, knee);
    EXPECT_GT(knee, 0);
  }
  for (const auto& [phase, published_deg] : thigh_deg) {
    const double off_deg = angle_deg(person[thigh_l], at(phase)) - published_deg;
    thigh_squares += off_deg * off_deg;
  }
  EXPECT_LT(std::sqrt(knee_squares / knee_deg.size()), 8);
  EXPECT_NEAR(most_knee_deg, 62, 7);  // Perry and Burnfield: 62 +- 7
  EXPECT_LT(std::sqrt(thigh_squares / thigh_deg.size()), 6);
  double thigh_low_deg = 0, thigh_high_deg = 0, bent_deg = 0, foot_low_deg = 0;
  for (double phase = 0; phase < 1; phase += 0.01) {
    const double thigh_at = angle_deg(person[thigh_l], at(phase));
    thigh_low_deg = std::min(thigh_low_deg, thigh_at);
    thigh_high_deg = std::max(thigh_high_deg, thigh_at);
    if (phase < 0.25)
      bent_deg = std::max(bent_deg, thigh_at - angle_deg(person[shank_l], at(phase)));
    const double ankle_at =
        angle_deg(person[foot_l], at(phase)) - angle_deg(person[shank_l], at(phase));
    foot_low_deg = std::min(foot_low_deg, ankle_at);
  }
  EXPECT_NEAR(thigh_high_deg, 25, 8);  // in the swing
  EXPECT_NEAR(thigh_low_deg, -20, 6);  // at the end of the stance
  EXPECT_NEAR(bent_deg, 18, 3);        // as the leg takes the weight, 15 to 20 degrees
  EXPECT_NEAR(foot_low_deg, -20, 6);   // as the foot pushes off
}

// Perry and Burnfield: a stride of 1.41 m at 82 m/min, here for a stature of 1.75 m. At an equal
// Froude number it grows as the stature does.
TEST(Figure, StridesHaveThePublishedLength) {
  const double at_m_s = 82.0 / 60 * std::sqrt(stature_m / 1.75);
  const auto person = person_on(flat(), at_m_s);
  const nanoseconds begin = landing(person, 1s), end = landing(person, begin + 200ms);
  const auto heel = [&](nanoseconds time) { return sole(person, 0, time)[0].p; };
  EXPECT_NEAR(glm::distance(heel(begin + 50ms), heel(end + 50ms)), 1.41 * stature_m / 1.75, 0.002);
}

TEST(Figure, DeviatesLittleBetweenPoses) {
  const auto usual = person_on(flat());
  const auto fine = person_on(flat(), speed_m_s, 250us);
  double most_m = 0;
  for (std::size_t part = 0; part < usual.size(); ++part) {
    for (nanoseconds time = 0s; time < 3s; time += 1250us) {
      for (const glm::dvec3 p_P : {glm::dvec3(0), glm::dvec3(0, 0, -0.3)}) {
        most_m = std::max(
            most_m, glm::distance(usual[part].pose_at(time) * p_P, fine[part].pose_at(time) * p_P));
      }
    }
  }
  EXPECT_LT(most_m, 2e-3);
  EXPECT_GT(most_m, 1e-6);  // the motions between poses are not those of the gait
}

}  // namespace
}  // namespace groundray::figure_test
