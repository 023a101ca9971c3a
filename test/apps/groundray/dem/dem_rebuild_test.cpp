#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <glm/vec3.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "apps/groundray/dem/dem_request.h"
#include "core/io/ply_io.h"
#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/pipeline/dem_pipeline.h"
#include "terrain/dem/dem_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::dem_rebuild_test {
namespace {

using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

constexpr float range_sd_m = 0.02F;
constexpr double eye_height_m = 4;

// Points in S of rough ground around the sensor, with a blank disc.
std::vector<glm::dvec3> ground_around_sensor() {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> anywhere(-8, 8);
  std::vector<glm::dvec3> points_m;
  for (int i = 0; i < 20'000; ++i) {
    const double x = anywhere(random), y = anywhere(random);
    if (std::hypot(x - 2, y) < 1) continue;
    points_m.emplace_back(x, y, 0.2 * std::sin(x) * std::cos(0.7 * y) - eye_height_m);
  }
  return points_m;
}

// The program reads the points from a file; the library gets them in memory.
TEST(DemRebuild, WritesTheHeightsThatTheLibraryComputes) {
  const TemporaryFolder folder;
  const std::vector<glm::dvec3> points_m = ground_around_sensor();
  PointCloud cloud(points_m.size());
  for (int axis = 0; axis < 3; ++axis) {
    const auto values = cloud.add<double>(std::string(1, "xyz"[axis]));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = points_m[i][axis];
  }
  write_ply(folder / "scan.ply", cloud, {});
  const PointNoise noise{.divergence_rad = 0.003, .position_sd_m = 0.01};
  DemRequest request{.choice = {.inputs = {folder / "scan.ply"}},
                     .taking = {.range_sd_m = range_sd_m},
                     .noise = {.points = noise},
                     .cell_m = 0.5,
                     .area_w = Area{{-6, -6}, {6, 6}}};
  request.dem.smooth = SmoothOptions{};
  request.output.dem = folder / "dem.tif";
  rebuild_dem(request);

  LidarBlock scan{.origins_m = std::vector<glm::dvec3>(points_m.size()), .share = 1};
  for (const glm::dvec3& p_m : points_m) append({p_m, {}, range_sd_m}, 0, noise, scan.points);
  bool is_first = true;
  const DemSources sources{.points = single_block(scan.points), .beams = [&](LidarBlock& block) {
                             block = scan;
                             return std::exchange(is_first, false);
                           }};
  const DemResult result = build_dem(sources, frame_over(*request.area_w, 0.5), request.dem);
  const Dem written = load_dem(folder / "dem.tif");
  const auto heights_m = written.grid.heights_m();
  ASSERT_EQ(heights_m.size(), result.layers.elevation_m.size());
  std::size_t filled = 0;
  for (std::size_t i = 0; i < heights_m.size(); ++i) {
    const double height_m = heights_m[i] + written.origin_w_m.z;
    EXPECT_EQ(static_cast<float>(height_m), result.layers.elevation_m[i]) << i;
    filled += result.layers.source[i] == HeightSource::Filled ? 1 : 0;
  }
  EXPECT_GT(filled, 3U);
}

}  // namespace
}  // namespace groundray::dem_rebuild_test
