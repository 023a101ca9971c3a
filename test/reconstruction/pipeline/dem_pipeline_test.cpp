#include "reconstruction/pipeline/dem_pipeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/pipeline/dem_points.h"
#include "test/reconstruction/dem/rolling_ground.h"

namespace groundray::dem_pipeline_test {
namespace {

using ::testing::ElementsAre;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

constexpr double half_m = 10, range_sd_m = 0.01;
const glm::dvec3 eye_m{0, 0, 30};

double plane_m(glm::dvec2 p) { return 0.1 * p.x - 0.05 * p.y; }

GridFrame grid() { return frame_over({{-half_m, -half_m}, {half_m, half_m}}, 0.5); }

// Beams from one position to 40,000 places of the surface, with noise along each.
template <typename Surface>
LidarBlock scan_of(const Surface& height_m, double blank_radius_m) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-half_m, half_m);
  std::normal_distribution<double> noise(0, range_sd_m);
  LidarBlock block{.share = 1};
  for (int i = 0; i < 40'000; ++i) {
    const glm::dvec2 at(anywhere(random), anywhere(random));
    if (glm::length(at) < blank_radius_m) continue;
    const glm::dvec3 p_m(at, height_m(at));
    const glm::dvec3 measured_m = p_m + noise(random) * glm::normalize(p_m - eye_m);
    append({measured_m, eye_m, range_sd_m}, 0, {}, block.points);
    block.origins_m.push_back(eye_m);
  }
  return block;
}

// Supplies the points in blocks of a size, and all beams at once.
DemSources sources_of(const LidarBlock& scan, std::size_t block_size) {
  const auto part = [&scan, block_size, at = std::size_t{0}](MeasuredPoints& block) mutable {
    block = {};
    const std::size_t end = std::min(scan.points.size(), at + block_size);
    for (; at < end; ++at)
      add_point(block, scan.points.p_m[at], scan.points.sd_m[at], scan.points.bias_sd_m[at],
                scan.points.across_sd_m[at], scan.points.groups[at], PointOrigin::Lidar,
                scan.points.lean[at]);
    return block.size() > 0;
  };
  return {.points = part, .beams = [&scan, is_first = true](LidarBlock& block) mutable {
            block = scan;
            return std::exchange(is_first, false);
          }};
}

std::vector<std::string> stages_of(const DemResult& result) {
  std::vector<std::string> names;
  for (const auto& [name, seconds] : result.seconds) names.push_back(name);
  return names;
}

// About 25 points per cell reduce the noise to a fifth. The blank disc is filled to the plane.
TEST(DemPipeline, APlaneBecomesThePlaneWithItsBlankAreaFilled) {
  const LidarBlock scan = scan_of(plane_m, 1.5);
  const DemResult result = build_dem(sources_of(scan, 7000), grid(), {.smooth = SmoothOptions{}});
  ASSERT_TRUE(result.has_ground);
  EXPECT_EQ(result.fusion.points, scan.points.size());
  EXPECT_THAT(stages_of(result), ElementsAre("fuse", "sight", "smooth", "fill"));
  const DemLayers& layers = result.layers;
  std::size_t filled = 0;
  for (int row = 0; row < layers.frame.samples.y; ++row) {
    for (int column = 0; column < layers.frame.samples.x; ++column) {
      const glm::dvec2 at = layers.frame.to_D({column, row});
      const std::size_t i = number_of(layers.frame, {column, row});
      ASSERT_NEAR(layers.elevation_m[i], plane_m(at), range_sd_m) << at.x << " " << at.y;
      EXPECT_NEAR(layers.slope_rad[i], std::atan(std::hypot(0.1, 0.05)), 0.03);
      EXPECT_EQ(layers.source[i] == HeightSource::Filled, std::isnan(layers.variance_m2[i]));
      filled += layers.source[i] == HeightSource::Filled ? 1 : 0;
    }
  }
  // Cells that lie wholly in the disc of radius 1.5 m, with centres up to 1.5 m - 0.36 m away.
  EXPECT_GE(filled, 12U);
  ASSERT_TRUE(result.filled);
  EXPECT_EQ(result.filled->filled, filled);
}

TEST(DemPipeline, ResultsDoNotDependOnTheBlocks) {
  const RollingGround ground(half_m, 10, 0, Seed{4});
  const LidarBlock scan = scan_of([&](glm::dvec2 p) { return ground.height_m(p); }, 1);
  const DemResult a = build_dem(sources_of(scan, 100'000), grid(), {}),
                  b = build_dem(sources_of(scan, 333), grid(), {});
  const auto same = [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  EXPECT_TRUE(std::ranges::equal(a.layers.elevation_m, b.layers.elevation_m, same));
  EXPECT_TRUE(std::ranges::equal(a.layers.variance_m2, b.layers.variance_m2, same));
  EXPECT_TRUE(std::ranges::equal(a.layers.upper_bound_m, b.layers.upper_bound_m, same));
  EXPECT_TRUE(std::ranges::equal(a.layers.fill_sd_m, b.layers.fill_sd_m, same));
  EXPECT_EQ(a.layers.source, b.layers.source);
}

// Lines of sight pass above the ground, so bounds do, up to the errors of their ends.
TEST(DemPipeline, BoundsOfRollingGroundAreAboveIt) {
  const RollingGround ground(half_m, 10, 0, Seed{4});
  const LidarBlock scan = scan_of([&](glm::dvec2 p) { return ground.height_m(p); }, 2);
  const DemResult result = build_dem(sources_of(scan, 5000), grid(), {});
  ASSERT_TRUE(result.bound);
  std::size_t bounded = 0;
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 40; ++column) {
      const std::size_t i = number_of(result.layers.frame, {column, row});
      const float most_m = result.layers.upper_bound_m[i];
      if (std::isnan(most_m)) continue;
      ++bounded;
      const double true_m = ground.height_m(result.layers.frame.to_D({column, row}));
      // The margin of a quarter of a cell covers slopes up to 1/2.
      EXPECT_GT(most_m, true_m - 0.1) << column << " " << row;
    }
  }
  EXPECT_EQ(result.bound->samples, bounded);
  EXPECT_GT(bounded, 1000U);
}

// A roof 3 m above the plane hides the ground: the filter removes its points, and only these.
TEST(DemPipeline, TheGroundFilterRemovesARoof) {
  const auto is_roof = [](glm::dvec2 p) { return std::abs(p.x) < 2 && std::abs(p.y) < 2; };
  const LidarBlock scan =
      scan_of([&](glm::dvec2 p) { return plane_m(p) + (is_roof(p) ? 3 : 0); }, 0);
  const auto roof = static_cast<std::uint64_t>(
      std::ranges::count_if(scan.points.p_m, [](const glm::dvec3& p) { return p.z > 2; }));
  DemSources sources = sources_of(scan, 9000);
  sources.beams = nullptr;
  const DemResult result = build_dem(sources, grid(), {.filter = GroundFilterOptions::airborne()});
  ASSERT_TRUE(result.ground);
  EXPECT_EQ(result.ground->above, roof);
  EXPECT_EQ(result.ground->ground, scan.points.size() - roof);
  EXPECT_FALSE(result.bound);
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 40; ++column) {
      const glm::dvec2 at = result.layers.frame.to_D({column, row});
      EXPECT_NEAR(result.layers.elevation_m[number_of(result.layers.frame, {column, row})],
                  plane_m(at), 0.05);
    }
  }
}

TEST(DemPipeline, WithoutGroundTheLaterStepsAreOmitted) {
  LidarBlock scan = scan_of(plane_m, 0);
  for (glm::dvec3& p_m : scan.points.p_m) p_m.x += 1000;
  const DemResult result = build_dem(sources_of(scan, 9000), grid(), {.smooth = SmoothOptions{}});
  EXPECT_FALSE(result.has_ground);
  EXPECT_EQ(result.fusion.outside, scan.points.size());
  EXPECT_THAT(stages_of(result), ElementsAre("fuse"));
  const DemResult filtered =
      build_dem(sources_of(scan, 9000), grid(), {.filter = GroundFilterOptions::airborne()});
  EXPECT_FALSE(filtered.has_ground);
  EXPECT_EQ(filtered.fusion.outside, scan.points.size());
}

}  // namespace
}  // namespace groundray::dem_pipeline_test
