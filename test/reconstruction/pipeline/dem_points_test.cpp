#include "reconstruction/pipeline/dem_points.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "test/support/scans/stereo_views.h"
#include "test/support/wave_texture.h"

namespace groundray::dem_points_test {
namespace {

using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

// Along a vertical beam only the range's noise moves the height, along a level one only the beam's
// direction does: its footprint at 20 m has a standard deviation of 20 m * 8 mrad / 4 = 0.04 m.
TEST(DemPoints, VerticalAndLevelBeamsHaveTheErrorsOfRangeAndDirection) {
  const PointNoise noise{
      .divergence_rad = 0.008, .position_sd_m = 0.3, .attitude_sd_rad = 0.02, .across_sd_m = 0};
  MeasuredPoints points;
  append({{1, 2, -20}, {1, 2, 0}, 0.1}, 3, noise, points);
  append({{21, 2, 0}, {1, 2, 0}, 0.1}, 4, noise, points);
  EXPECT_FLOAT_EQ(points.sd_m[0], 0.1F);
  EXPECT_FLOAT_EQ(points.across_sd_m[0], 0.04F);
  EXPECT_FLOAT_EQ(points.bias_sd_m[0], 0.3F);
  EXPECT_FLOAT_EQ(points.sd_m[1], 0.04F);
  EXPECT_FLOAT_EQ(points.across_sd_m[1], static_cast<float>(std::hypot(0.1, 0.04) / std::sqrt(2)));
  EXPECT_FLOAT_EQ(points.bias_sd_m[1], 0.5F);  // 0.3 and 20 * 0.02 = 0.4
  EXPECT_EQ(points.groups[1], 4U);
}

// Two cameras at a height of 6 m look down at level ground at height 0.
TEST(DemPoints, AStereoPairMeasuresLevelGround) {
  constexpr glm::ivec2 size_px{160, 120};
  constexpr double focal_px = 150, height_m = 6;
  const Pinhole lens{{.focal_px = glm::dvec2(focal_px), .centre_px = {79.5, 59.5}}};
  const WaveTexture waves(4 * height_m / focal_px, Seed{7});
  StereoImages images;
  for (const std::size_t side : {0, 1}) {
    const double x_m = 0.5 * static_cast<double>(side);
    images.views[side] =
        view_of(lens, size_px, {.rotation = {0, 1, 0, 0}, .translation_m = {x_m, 0, height_m}});
    images.greys[side] = waves.image(size_px, [&](glm::dvec2 pixel) {
      const glm::dvec2 at = (pixel - glm::dvec2(79.5, 59.5)) * height_m / focal_px;
      return glm::dvec2(x_m + at.x, -at.y);
    });
  }
  MeasuredPoints points;
  EXPECT_GT(append(images, {}, {}, 9, points).matched(), 8000U);
  ASSERT_GT(points.size(), 150U);
  // Four standard deviations: one in 16,000 normal errors exceeds them.
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_LT(std::abs(points.p_m[i].z), 4 * std::hypot(points.sd_m[i], points.bias_sd_m[i])) << i;
  MeasuredPoints twice = points;
  append(points, twice);
  EXPECT_EQ(twice.size(), 2 * points.size());
  EXPECT_EQ(twice.p_m.back(), points.p_m.back());
  EXPECT_EQ(twice.across_sd_m.size(), twice.size());
}

}  // namespace
}  // namespace groundray::dem_points_test
