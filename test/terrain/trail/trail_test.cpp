#include "terrain/trail/trail.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/error.h"
#include "core/tracing/ray_tracer.h"
#include "terrain/relief/relief.h"
#include "terrain/terrain_scene.h"
#include "terrain/trail/trails.h"
#include "test/terrain/trail/straight_trail.h"

namespace groundray::trail_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double cell_m = 0.05;

Trail trail_on(const TrailSpec& spec, const auto& height_m) {
  return {spec, [&](glm::dvec2 p) { return std::optional<double>(height_m(p)); }, {0, 0}, cell_m};
}

double height_m(const Trail& trail, const auto& ground_m, double along_m, double across_m) {
  const glm::dvec2 p = start + along_m * along + across_m * left;
  Trail::Shape shape{ground_m(p), 1};
  trail.apply(p, shape);
  return shape.height_m;
}

TEST(Trail, CrossSectionOnAPlaneIsItsClosedForm) {
  const Trail trail = trail_on(with_ruts_and_a_ditch(), plane_m);
  for (double s = 6; s < length_m - 6; s += 0.37) {
    for (double u = -8; u <= 8; u += 0.013)
      ASSERT_NEAR(height_m(trail, plane_m, s, u), section_m(s, u), 1e-9) << s << ", " << u;
  }
}

TEST(Trail, RaisedAndLoweredTrailsHaveBanksOfTheirSlope) {
  const auto flat_m = [](glm::dvec2) { return 0.0; };
  for (const double raised_m : {1.5, -1.5}) {
    TrailSpec spec = straight();
    spec.width_m = 3;
    spec.raised_m = raised_m;
    const Trail trail = trail_on(spec, flat_m);
    for (double u = 0; u < 6; u += 0.01) {
      const double bank_m = std::max(0.0, 1.5 - 0.5 * std::max(0.0, u - 1.5));
      ASSERT_NEAR(height_m(trail, flat_m, 30, u), std::copysign(bank_m, raised_m), 1e-12) << u;
    }
  }
}

TEST(Trail, WashboardIsASine) {
  const auto flat_m = [](glm::dvec2) { return 0.0; };
  TrailSpec spec = straight();
  spec.washboard = {.wavelength_m = 0.7, .amplitude_m = 0.02};
  const Trail trail = trail_on(spec, flat_m);
  for (double s = 5; s < 60; s += 0.01) {
    ASSERT_NEAR(height_m(trail, flat_m, s, 0), 0.02 * std::sin(2 * std::numbers::pi * s / 0.7),
                1e-9);
    ASSERT_NEAR(height_m(trail, flat_m, s, 1.5), 0, 1e-9);
  }
}

// A sine along the trail is levelled to the part that the weights of the average leave of it, which
// is computed here by another sum.
TEST(Trail, HeightsAreAveragedAlongTheLine) {
  const auto waves_m = [](glm::dvec2 p) { return std::sin(glm::dot(p - start, along)); };
  TrailSpec spec = straight();
  spec.level_over_m = 6;
  spec.most_grade = 2;
  const Trail trail = trail_on(spec, waves_m);
  double sum = 0, weights = 0;
  for (int k = -6; k <= 6; ++k) {
    const double weight = std::pow(1 - std::pow(k / 7.0, 2), 2);
    sum += weight * std::cos(0.5 * k);
    weights += weight;
  }
  for (int s = 10; s < 60; ++s)
    ASSERT_NEAR(height_m(trail, waves_m, s, 0), sum / weights * std::sin(s), 1e-9) << s;
  EXPECT_LT(sum / weights, 0.6);
}

// A paraboloid of fourth order of diameter d and depth h has a volume of pi d^2 h / 12.
TEST(Trail, PotholesHaveTheVolumeOfTheirNumber) {
  const auto flat_m = [](glm::dvec2) { return 0.0; };
  double volume_m3 = 0, lowest_m = 0;
  constexpr int trails = 20;
  for (std::uint64_t variant = 0; variant < trails; ++variant) {
    TrailSpec spec = straight();
    spec.width_m = 3;
    spec.potholes = {.per_100_m = 20, .diameter_m = {0.8, 0.8}, .depth_m = 0.1};
    spec.variant = Seed{variant};
    const Trail trail = trail_on(spec, flat_m);
    constexpr double step_m = 0.08;
    for (double s = 4; s < length_m - 4; s += step_m) {
      for (double u = -1.5; u < 1.5; u += step_m) {
        const double z_m = height_m(trail, flat_m, s, u);
        ASSERT_LE(z_m, 0);
        lowest_m = std::min(lowest_m, z_m);
        volume_m3 -= z_m * step_m * step_m;
      }
    }
  }
  const double expected_m3 =
      trails * 20 * (length_m - 8) / 100 * std::numbers::pi * 0.64 * 0.1 / 12;
  // About 250 potholes of which the number in the middle of a trail varies: 4 standard deviations.
  EXPECT_NEAR(volume_m3, expected_m3, 4 * expected_m3 / std::sqrt(250.0));
  EXPECT_NEAR(lowest_m, -0.1, 0.1 * 2);  // where two overlap, it is deeper
}

TEST(Trail, ReliefRemainsByItsShare) {
  TrailSpec spec = straight();
  spec.width_m = 4;
  spec.relief_share = 0.25;
  const Trail trail = trail_on(spec, plane_m);
  const auto share_at = [&](double u) {
    const glm::dvec2 p = start + 30.0 * along + u * left;
    Trail::Shape shape{plane_m(p), 1};
    trail.apply(p, shape);
    return shape.relief_share;
  };
  EXPECT_DOUBLE_EQ(share_at(0), 0.25);
  EXPECT_DOUBLE_EQ(share_at(-1.99), 0.25);
  EXPECT_NEAR(share_at(3), (1 + 0.25) / 2, 1e-9);
  EXPECT_DOUBLE_EQ(share_at(4.5), 1);
}

// Rays straight down and slanting meet the cells through samples of the closed form. Between the
// samples, a facet differs from it by at most (h^2 / 4) max |f''|; ruts have the largest, 32 depth
// / width^2, ditches and crown less.
TEST(Trail, RaysMeetTheClosedFormOfRutsAndDitches) {
  TrailSpec spec = straight();
  spec.width_m = 4;
  spec.crown_m = 0.12;
  spec.ruts = {.track_m = 1.8, .width_m = 0.5, .depth_m = 0.1, .berm_m = 0};
  spec.ditches = {.width_m = 1.2, .depth_m = 0.4};
  const HeightGrid dem = grid_of(plane_m);
  const auto relief = Relief({.cell_m = 0.1, .trails = {spec}}, dem.frame(), std::size_t{1} << 30)
                          .with_trails(std::vector{spec}, heights_of(dem), {0, 0});
  const HeightGrid ground = relief->refined(dem);
  const Trail& trail = relief->trails()->all()[0];
  const RayTracer tracer({full_resolution_level(ground)}, {0, 0, 0}, Tracing::Exact);
  const double fine_m = ground.step_m().x;
  const double off_m = fine_m * fine_m / 4 * 32 * 0.1 / 0.25 + 1e-5;
  std::vector<Ray> rays;
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    const glm::dvec2 where = random_uniform({Seed{9}, 0, 0, i});
    const glm::dvec2 p = start + (5 + 60 * where.x) * along + (6.2 * where.y - 3.1) * left;
    const glm::dvec2 lean = random_uniform({Seed{9}, 1, 0, i}) - 0.5;
    rays.push_back({{p, 30}, glm::normalize(glm::dvec3(i % 2 == 0 ? lean : glm::dvec2(0), -1))});
  }
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_TRUE(hits[i]) << i;
    const glm::dvec3 p = rays[i].origin + hits[i].range_m * rays[i].direction;
    const glm::dvec2 at(glm::dot(glm::dvec2(p) - start, along),
                        glm::dot(glm::dvec2(p) - start, left));
    if (std::abs(at.y) > 3.15 || at.x < 4.5 || at.x > 65) continue;
    ASSERT_NEAR(p.z, height_m(trail, plane_m, at.x, at.y), off_m) << at.x << ", " << at.y;
  }
}

std::string error_of(const TrailSpec& spec, const auto& height_m) {
  try {
    trail_on(spec, height_m);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Trail, ErrorsNameThePlaceInW) {
  const HeightGrid dem = grid_of([](glm::dvec2 p) { return p.x > 0 ? 0.5 * p.x : 0.0; });
  TrailSpec spec{.name = "track", .waypoints_m = {{970, 1000}, {1040, 1000}}, .level_over_m = 0};
  const auto said = [&] {
    try {
      Trails({&spec, 1}, heights_of(dem), {1000, 1000}, cell_m);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(said(),
              AllOf(HasSubstr("trail 'track': its grade of 26.6 degrees exceeds most_grade_deg = "
                              "25.2"),
                    HasSubstr("at (1000.5, 1000.0) m in W, 30.5 m along it")));
  spec.most_grade = 1;
  spec.waypoints_m[1].x = 1070;
  EXPECT_THAT(said(), HasSubstr("(1070.0, 1000.0) m in W is outside the DEM or in a hole"));
  spec.waypoints_m[1].x = 1040;
  spec.level_over_m = 60;
  spec.most_bank_m = 0.5;
  EXPECT_THAT(said(), HasSubstr("it needs an embankment of 0.5"));
}

TEST(Trail, BanksMustMeetTheGround) {
  const auto side_slope_m = [](glm::dvec2 p) { return 0.6 * glm::dot(p - start, left); };
  TrailSpec spec = straight();
  spec.bank_slope = 0.67;  // of 2 m end where the ground is 2.7 m higher
  EXPECT_THAT(error_of(spec, side_slope_m), HasSubstr("more than most_bank_m = 2"));
  spec.most_bank_m = 9;  // they meet it 0.9 / 0.07 m from the edge, 8.6 m higher
  EXPECT_EQ(error_of(spec, side_slope_m), "no error");
}

TEST(Trail, HugeNumbersAreErrors) {
  TrailSpec spec = straight();
  spec.waypoints_m[1] = {1e300, 0};
  EXPECT_THAT(error_of(spec, plane_m), HasSubstr("more than the limit of 1e+06 m"));
  spec = straight();
  spec.width_m = 1e300;
  spec.most_bank_m = 100;
  spec.bank_slope = 0.1;
  spec.potholes = {.per_100_m = 1e300};
  EXPECT_THAT(error_of(spec, plane_m),
              AllOf(HasSubstr("width_m = 1e+300"), HasSubstr("such banks reach 1000 m"),
                    HasSubstr("potholes.per_100_m = 1e+300 must be from 0 to 10000")));
}

TEST(Trail, ErrorListsEveryFault) {
  TrailSpec spec = straight();
  spec.waypoints_m = {{0, 0}, {0, 0}};
  spec.bank_slope = 0;
  spec.ruts = {.track_m = 3, .width_m = 0.06, .depth_m = -1};
  spec.washboard = {.wavelength_m = 0.1};
  spec.potholes = {.per_100_m = -1, .diameter_m = {2, 1}};
  spec.ditches = {.width_m = 0.01};
  spec.roots = {.width_m = 0.01};
  EXPECT_THAT(error_of(spec, plane_m),
              AllOf(HasSubstr("is it a duplicate?"), HasSubstr("bank_slope = 0 must be from 0.01"),
                    HasSubstr("ruts.width_m = 0.06 must be at least two cells of the relief, 0.1"),
                    HasSubstr("ruts.depth_m = -1"), HasSubstr("more than the trail's width_m = 3"),
                    HasSubstr("half of washboard.wavelength_m = 0.05"),
                    HasSubstr("potholes.per_100_m = -1"),
                    HasSubstr("potholes.diameter_m = [2, 1] must increase"),
                    HasSubstr("ditches.width_m = 0.01"), HasSubstr("roots.width_m = 0.01")));
}

TEST(Trails, EachLiesOverThoseBeforeIt) {
  const HeightGrid dem = grid_of([](glm::dvec2) { return 0.0; });
  TrailSpec creek{.name = "creek", .waypoints_m = {{-20, 0}, {20, 0}}, .raised_m = -1};
  TrailSpec ford{
      .name = "ford", .waypoints_m = {{0, -20}, {0, 20}}, .level_over_m = 0, .most_grade = 2};
  const std::vector both{creek, ford};
  const Trails trails(both, heights_of(dem), {0, 0}, cell_m);
  EXPECT_DOUBLE_EQ(trails.height_m({10, 0}, 0, 0), -1);
  EXPECT_DOUBLE_EQ(trails.height_m({0, 0}, 0, 0), -1);       // the ford descends into the creek
  EXPECT_DOUBLE_EQ(trails.height_m({1, 10}, 0, 0.5), 0.15);  // 0.3 of the relief remain
  EXPECT_TRUE(std::isnan(trails.height_m({0, 0}, std::nan(""), 0)));
  const std::vector reversed{ford, creek};
  EXPECT_NE(trails.fingerprint(), Trails(reversed, heights_of(dem), {0, 0}, cell_m).fingerprint());
}

}  // namespace
}  // namespace groundray::trail_test
