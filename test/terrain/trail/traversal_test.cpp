// Vehicles on trails whose cross-sections have a closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "core/geometry/pose.h"
#include "core/geometry/trajectory.h"
#include "terrain/ground.h"
#include "terrain/ground_path.h"
#include "terrain/relief/relief.h"
#include "test/terrain/trail/straight_trail.h"

namespace groundray::trail_test {
namespace {

// Drive over a trail on a DEM, with the slopes of the body along the trail and to its left.
struct Passage {
  Passage(const TrailSpec& spec, const HeightGrid& dem, glm::dvec2 from, glm::dvec2 to) {
    const auto relief = Relief({.cell_m = 0.04, .trails = {spec}}, dem.frame(), 1u << 30)
                            .with_trails(std::vector{spec}, heights_of(dem), {0, 0});
    const double seconds = std::floor(100 * glm::distance(from, to)) / 100 - 0.01;
    const auto at = [](glm::dvec2 p) { return start + p.x * along + p.y * left; };
    path = build_ground_path(Ground(dem, relief),
                             {.waypoints_m = {at(from), at(to)},
                              .footprint_m = {wheel_base_m, track_m},
                              .duration = std::chrono::milliseconds(std::llround(1e3 * seconds))})
               .samples();
  }
  static glm::dvec2 place(const Pose& X_DB) {
    const glm::dvec2 p = glm::dvec2(X_DB.translation_m) - start;
    return {glm::dot(p, along), glm::dot(p, left)};
  }
  static glm::dvec2 slopes(const Pose& X_DB) {
    const glm::dvec3 up = X_DB.rotation * glm::dvec3(0, 0, 1);
    return {-glm::dot(glm::dvec2(up), along) / up.z, -glm::dot(glm::dvec2(up), left) / up.z};
  }
  static constexpr double wheel_base_m = 2.5, track_m = 1.7;
  std::vector<Trajectory::Sample> path;
};

// Fine cells are h = 1/32 m wide, the largest power of two below cell_m. A facet differs from the
// section by at most (h^2 / 4) max |f''|, 24 / m at the berms, and by a quarter of the change of
// slope, 0.5, over their diagonal at edges.
constexpr double wheel_off_m = std::max(24.0 / (32 * 32 * 4), 0.5 * 1.42 / (32 * 4)) + 1e-5;

TEST(TrailTraversal, VehiclesFollowRutsByTheirClosedForm) {
  const HeightGrid dem = grid_of(plane_m);
  for (const double u : {0.0, 0.05, 0.35, -0.9, 1.0}) {
    const Passage drive(with_ruts_and_a_ditch(), dem, {8, u}, {60, u});
    const double half_m = Passage::track_m / 2;
    const double lean = (section_m(0, u + half_m) - section_m(0, u - half_m)) / Passage::track_m;
    ASSERT_GT(drive.path.size(), 5000);
    for (const auto& [time, X_DB] : drive.path) {
      const double s = Passage::place(X_DB).x;
      ASSERT_NEAR(X_DB.translation_m.z, section_m(s, u), wheel_off_m) << s;
      ASSERT_NEAR(Passage::slopes(X_DB).x, grade, 2 * wheel_off_m / Passage::wheel_base_m) << s;
      ASSERT_NEAR(Passage::slopes(X_DB).y, lean, 2 * wheel_off_m / Passage::track_m) << s;
    }
  }
}

TEST(TrailTraversal, VehiclesCrossRutsAndDitchesByTheirClosedForm) {
  const Passage drive(with_ruts_and_a_ditch(), grid_of(plane_m), {30, -8}, {30, 8});
  double steepest = 0;
  for (const auto& [time, X_DB] : drive.path) {
    const double u = Passage::place(X_DB).y, half_m = Passage::wheel_base_m / 2;
    const double climb = (section_m(0, u + half_m) - section_m(0, u - half_m)) / (2 * half_m);
    ASSERT_NEAR(X_DB.translation_m.z, section_m(30, u), wheel_off_m) << u;
    ASSERT_NEAR(Passage::slopes(X_DB).y, climb, wheel_off_m / half_m) << u;
    ASSERT_NEAR(Passage::slopes(X_DB).x, grade, 2 * wheel_off_m / Passage::track_m) << u;
    steepest = std::max(steepest, std::abs(climb));
  }
  EXPECT_GT(steepest, 0.15);  // an axle in the ditch
}

// Where all wheels stand on the bank, its plane is that of the vehicle; on the crest, the vehicle
// is level.
TEST(TrailTraversal, VehiclesClimbTheRampOfAnEmbankment) {
  TrailSpec spec = straight();
  spec.raised_m = 1.5;
  spec.width_m = 6;
  const auto bank_m = [](double u) { return std::clamp(1.5 - 0.5 * (std::abs(u) - 3), 0.0, 1.5); };
  const Passage drive(spec, grid_of([](glm::dvec2) { return 0.0; }), {30, -9}, {30, 9});
  int on_ramp = 0, on_top = 0;
  for (const auto& [time, X_DB] : drive.path) {
    const double u = Passage::place(X_DB).y, half_m = Passage::wheel_base_m / 2;
    ASSERT_NEAR(X_DB.translation_m.z, bank_m(u), wheel_off_m) << u;
    const glm::dvec2 slopes = Passage::slopes(X_DB);
    ASSERT_NEAR(slopes.y, (bank_m(u + half_m) - bank_m(u - half_m)) / (2 * half_m),
                wheel_off_m / half_m);
    if (-5.9 < u - half_m && u + half_m < -3.1) {
      ASSERT_NEAR(slopes.y, 0.5, 1e-5) << u;
      ++on_ramp;
    }
    if (std::abs(u) + half_m < 2.9) {
      ASSERT_NEAR(slopes.y, 0, 1e-6) << u;
      ++on_top;
    }
  }
  EXPECT_GT(on_ramp, 20);
  EXPECT_GT(on_top, 300);
}

}  // namespace
}  // namespace groundray::trail_test
