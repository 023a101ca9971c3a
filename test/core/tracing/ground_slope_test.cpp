#include "core/tracing/ground_slope.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <vector>

#include "core/tracing/scene.h"
#include "terrain/terrain_scene.h"
#include "test/support/margin.h"

namespace groundray::ground_slope_test {
namespace {

constexpr glm::dvec2 origin_m{500, 8000};
constexpr glm::dvec2 step_m{2, -3};

// Ground of a height that is quadratic in x and y: central differences are exact on it, and its
// gradients are linear.
struct Quadratic {
  double xx = 0, xy = 0, yy = 0;  // per metre
  glm::dvec2 slope{0};            // at the origin

  double height_m(glm::dvec2 p) const {
    const glm::dvec2 d = p - origin_m;
    return xx * d.x * d.x + xy * d.x * d.y + yy * d.y * d.y + glm::dot(slope, d);
  }
  double slope_rad(glm::dvec2 p) const {
    const glm::dvec2 d = p - origin_m;
    return std::atan(
        glm::length(slope + glm::dvec2(2 * xx * d.x + xy * d.y, xy * d.x + 2 * yy * d.y)));
  }
};

constexpr Quadratic bowl{0.004, -0.002, 0.003, {0.1, -0.3}};

std::vector<float> heights_of(const Quadratic& ground, glm::ivec2 size, int step, glm::ivec2 last) {
  std::vector<float> heights_m;
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column) {
      const glm::dvec2 sample(std::min(column * step, last.x), std::min(row * step, last.y));
      heights_m.push_back(static_cast<float>(ground.height_m(origin_m + sample * step_m)));
    }
  }
  return heights_m;
}

HeightGrid grid_of(const Quadratic& ground, int samples) {
  return {{samples, samples},
          origin_m,
          step_m,
          heights_of(ground, {samples, samples}, 1, {samples - 1, samples - 1})};
}

RayTracer tracer_of(std::vector<Level> levels) {
  return {std::move(levels), glm::dvec3(origin_m, 0), Tracing::Fast};
}

// A slope differs from the exact one by the rounding of heights to float, over 2 m.
double rounding(const Quadratic& ground, int samples) {
  const glm::dvec2 far = origin_m + glm::dvec2(samples - 1) * step_m;
  const double highest_m =
      std::abs(ground.height_m(far)) + std::abs(ground.height_m({far.x, origin_m.y}));
  return 2 * std::ldexp(highest_m, -24);
}

TEST(GroundSlope, IsExactOnQuadraticGround) {
  constexpr int samples = 33;
  const RayTracer tracer = tracer_of({full_resolution_level(grid_of(bowl, samples))});
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> inside(1, samples - 2);  // differences are central
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec2 p = origin_m + glm::dvec2(inside(random), inside(random)) * step_m;
    const auto slope_rad = ground_slope_rad(tracer, p);
    ASSERT_TRUE(slope_rad);
    worst = std::max(worst, std::abs(*slope_rad - bowl.slope_rad(p)));
  }
  EXPECT_LT(worst, rounding(bowl, samples));
  testing::record_margin("slope of quadratic ground", worst, rounding(bowl, samples));
}

TEST(GroundSlope, IsExactOnPlanesUpToTheBoundary) {
  const Quadratic plane{.slope = {0.25, 0.5}};
  constexpr int samples = 9;
  const RayTracer tracer = tracer_of({full_resolution_level(grid_of(plane, samples))});
  for (const double column : {0.0, 0.5, 4.0, 7.5, 8.0}) {
    for (const double row : {0.0, 3.25, 8.0}) {
      const auto slope_rad = ground_slope_rad(tracer, origin_m + glm::dvec2(column, row) * step_m);
      ASSERT_TRUE(slope_rad) << column << ' ' << row;
      EXPECT_NEAR(*slope_rad, plane.slope_rad({}), rounding(plane, samples))
          << column << ' ' << row;
    }
  }
  for (const glm::dvec2 outside : {glm::dvec2{-0.1, 4}, {8.1, 4}, {4, -0.1}, {4, 8.1}})
    EXPECT_FALSE(ground_slope_rad(tracer, origin_m + outside * step_m));
}

TEST(GroundSlope, UsesTheSamplesOfTheFinestLevelThere) {
  // Every fourth sample of 31, and the last, which is nearer.
  constexpr int samples = 31, step = 4, points = 9;
  Level coarse{.frame = grid_of(bowl, samples).frame(),
               .heights = {{points, points}, heights_of(bowl, {points, points}, step, {30, 30})},
               .step = step};
  for (int row = 0; row < samples - 1; row += 32)
    coarse.leaves.push_back({.column = 0, .row = row, .step = step, .high_m = 100});
  const glm::dvec2 near = origin_m + glm::dvec2(13.7, 9.2) * step_m;
  const RayTracer alone = tracer_of({coarse});
  EXPECT_NEAR(ground_slope_rad(alone, near).value(), bowl.slope_rad(near), rounding(bowl, samples));
  const Quadratic plane{.slope = {0.25, 0.5}};
  Level fine = full_resolution_level(grid_of(plane, 17));
  fine.frame = coarse.frame;
  const RayTracer nested = tracer_of({fine, coarse});
  EXPECT_NEAR(ground_slope_rad(nested, near).value(), plane.slope_rad({}), rounding(plane, 17));
  const glm::dvec2 far = origin_m + glm::dvec2(21.3, 18.8) * step_m;
  EXPECT_NEAR(ground_slope_rad(nested, far).value(), bowl.slope_rad(far), rounding(bowl, samples));
}

TEST(GroundSlope, BridgesSingleMissingSamples) {
  const Quadratic plane{.slope = {0.25, 0.5}};
  constexpr int samples = 9;
  std::vector<float> heights_m = heights_of(plane, {samples, samples}, 1, {8, 8});
  const auto lose = [&](std::size_t column, std::size_t row) {
    heights_m[row * samples + column] = std::numeric_limits<float>::quiet_NaN();
  };
  const auto slope_at = [&](double column, double row) {
    const RayTracer tracer =
        tracer_of({full_resolution_level({{samples, samples}, origin_m, step_m, heights_m})});
    return ground_slope_rad(tracer, origin_m + glm::dvec2(column, row) * step_m);
  };
  lose(4, 4);
  for (const double column : {2.5, 3.5, 4.5, 5.5}) {
    for (const double row : {2.5, 3.5, 4.5, 5.5}) {
      EXPECT_NEAR(slope_at(column, row).value(), plane.slope_rad({}), rounding(plane, samples))
          << column << ' ' << row;
    }
  }
  lose(5, 4);  // now neither has a gradient along x
  for (const double column : {3.5, 4.5, 5.5}) {
    EXPECT_FALSE(slope_at(column, 3.5)) << column;
    EXPECT_FALSE(slope_at(column, 4.5)) << column;
  }
  EXPECT_NEAR(slope_at(2.5, 4.5).value(), plane.slope_rad({}), rounding(plane, samples));
  EXPECT_NEAR(slope_at(4.5, 2.5).value(), plane.slope_rad({}), rounding(plane, samples));
}

TEST(GroundSlope, DecidesOnLayersInsteadOfFacets) {
  constexpr int samples = 33;
  constexpr double limit_rad = 0.65;
  Scene scene{tracer_of({full_resolution_level(grid_of(bowl, samples))}), {}};
  scene.cover =
      GroundCover({{.label = 1}, {.label = 2, .slope_rad = {limit_rad, 2, 0}}}, nullptr, {});
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> inside(1, samples - 2);
  int steep = 0, facet_differs = 0;
  for (int i = 0; i < 2000; ++i) {
    const glm::dvec2 p = origin_m + glm::dvec2(inside(random), inside(random)) * step_m;
    const double slope_rad = bowl.slope_rad(p);
    if (std::abs(slope_rad - limit_rad) < rounding(bowl, samples)) continue;
    const Ray down{{p, 1000}, {0, 0, -1}};
    Hit hit;
    scene.trace({&down, 1}, {&hit, 1});
    const bool is_steep = slope_rad > limit_rad;
    ASSERT_EQ(scene.truth_of(down, hit).label, is_steep ? 2 : 1) << i;
    steep += is_steep;
    facet_differs += (std::acos(glm::normalize(glm::dvec3(hit.normal)).z) > limit_rad) != is_steep;
  }
  EXPECT_GT(steep, 200);
  EXPECT_LT(steep, 1800);
  EXPECT_GT(facet_differs, 10);  // facets would decide otherwise
}

}  // namespace
}  // namespace groundray::ground_slope_test
