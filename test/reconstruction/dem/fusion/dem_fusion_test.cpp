#include "reconstruction/dem/fusion/dem_fusion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "reconstruction/dem/dem_layers.h"
#include "test/reconstruction/dem/rolling_ground.h"
#include "test/support/file_size_limit.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"

namespace groundray::dem_fusion_test {
namespace {

using testing::add_point;
using ::testing::HasSubstr;
using testing::record_margin;
using enum PointOrigin;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Source that delivers the points in blocks of at most `most`.
PointSource in_blocks(const MeasuredPoints& points, std::size_t most) {
  return [&points, most, next = std::size_t{0}](MeasuredPoints& block) mutable {
    if (next >= points.size()) return false;
    block = {};
    const std::size_t end = std::min(points.size(), next + most);
    for (; next < end; ++next) {
      add_point(block, points.p_m[next], points.sd_m[next], points.bias_sd_m[next],
                points.across_sd_m[next], points.groups[next], points.origins[next],
                points.lean[next]);
    }
    return true;
  };
}

Fusion fuse_all(const MeasuredPoints& points, const GridFrame& frame,
                const FusionOptions& options = {}) {
  return fuse(in_blocks(points, points.size()), frame, options);
}

glm::dvec2 uniform(std::size_t i, std::uint32_t what) {
  return random_uniform({.seed = Seed{3}, .frame = what, .pulse = static_cast<std::uint32_t>(i)});
}
glm::dvec2 normal(std::size_t i, std::uint32_t what) {
  return random_normal({.seed = Seed{4}, .frame = what, .pulse = static_cast<std::uint32_t>(i)});
}

void expect_refusal(const std::function<void()>& act, const char* message) {
  try {
    act();
    ADD_FAILURE() << "no Error that says: " << message;
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(message));
  }
}

// Compares bytes, so that NaN equals NaN.
template <typename T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

void expect_same(const DemLayers& a, const DemLayers& b) {
  EXPECT_TRUE(same(a.elevation_m, b.elevation_m));
  EXPECT_TRUE(same(a.variance_m2, b.variance_m2));
  EXPECT_TRUE(same(a.lidar, b.lidar));
  EXPECT_TRUE(same(a.stereo, b.stereo));
  EXPECT_TRUE(same(a.chi2, b.chi2));
  EXPECT_TRUE(same(a.surfaces, b.surfaces));
  EXPECT_TRUE(same(a.overhang_m, b.overhang_m));
  EXPECT_TRUE(same(a.clearance_m, b.clearance_m));
  EXPECT_TRUE(same(a.source, b.source));
  EXPECT_TRUE(same(a.slope_rad, b.slope_rad));
}

// Heights are stored to 2^-17 m and positions to 2^-17 of a cell: with slopes below 1 no sample of
// exact points is farther from the plane than two such steps.
TEST(DemFusion, PointsOfAPlaneReproduceThePlane) {
  const auto plane = [](glm::dvec2 p) { return 812.7 + 0.3 * p.x - 0.45 * p.y; };
  for (const GridFrame& frame : {frame_over({{-4, 3}, {6, 9}}, 0.25),
                                 GridFrame{{30, 20}, {5, -8}, {-0.5, 0.3}, {-2, 1 / 0.3}}}) {
    MeasuredPoints points;
    for (std::size_t i = 0; i < 30'000; ++i) {
      const glm::dvec2 at = uniform(i, 0) * glm::dvec2(frame.samples) - 0.5;
      const glm::dvec2 p = frame.origin_m + at * frame.step_m;
      add_point(points, {p, plane(p)}, 0.01, 0.001, 0, static_cast<std::uint32_t>(i % 3), Lidar);
    }
    const Fusion fusion = fuse_all(points, frame);
    EXPECT_EQ(fusion.counts.outside, 0U);
    double worst_m = 0;
    for (int row = 0; row < frame.samples.y; ++row) {
      for (int column = 0; column < frame.samples.x; ++column) {
        const auto i = testing::number_of(frame, {column, row});
        ASSERT_EQ(fusion.layers.source[i], HeightSource::Lidar);
        EXPECT_NEAR(fusion.layers.slope_rad[i], std::atan(std::hypot(0.3, 0.45)), 2e-3);
        const double error =
            double{fusion.layers.elevation_m[i]} - plane(frame.to_D({column, row}));
        worst_m = std::max(worst_m, std::abs(error));
      }
    }
    const double tolerance_m = 2.0 / 65536 + 812 * 1.2e-7;  // plus the rounding of the float output
    EXPECT_LE(worst_m, tolerance_m);
    record_margin("fused points of a plane", worst_m, tolerance_m, "m");
  }
}

// Ground at 1 m in all cells of a frame of 8 x 8, with `each` points per cell.
MeasuredPoints flat_ground(const GridFrame& frame, std::size_t each) {
  MeasuredPoints points;
  for (std::size_t i = 0; i < each * 64; ++i) {
    const glm::ivec2 cell(static_cast<int>(i % 8), static_cast<int>(i / 8 % 8));
    const glm::dvec2 p = frame.to_D(cell) + (uniform(i, 20) - 0.5) * frame.step_m;
    add_point(points, {p, 1 + 0.01 * normal(i, 21).x}, 0.01, 0, 0,
              static_cast<std::uint32_t>(i / 64), Lidar);
  }
  return points;
}

TEST(DemFusion, IsolatedLowPointsAreNotGround) {
  const GridFrame frame = frame_over({{0, 0}, {2, 2}}, 0.25);
  for (const std::size_t each : {1U, 3U, 12U}) {
    MeasuredPoints points = flat_ground(frame, each);
    const glm::dvec2 at = frame.to_D({4, 4});
    if (each == 1) {
      points.p_m[36].z = -2;  // the only point of cell (4, 4)
    } else {
      add_point(points, {at, -2}, 0.01, 0, 0, 1, Lidar);
    }
    const Fusion fusion = fuse_all(points, frame);
    for (std::size_t i = 0; i < 64; ++i) {
      if (each == 1 && i == 36) {
        EXPECT_EQ(fusion.layers.source[i], HeightSource::None);
        EXPECT_EQ(fusion.counts.without_ground, 1U);
      } else {
        EXPECT_NEAR(fusion.layers.elevation_m[i], 1, 0.05);
        EXPECT_EQ(fusion.layers.surfaces[i], 1);
      }
    }
  }
}

TEST(DemFusion, PointsAboveTheGroundAreOverhang) {
  const GridFrame frame = frame_over({{0, 0}, {2, 2}}, 0.25);
  MeasuredPoints points = flat_ground(frame, 10);
  for (std::size_t i = 0; i < 30; ++i)
    add_point(points, {frame.to_D({2, 5}), 3.5 + 0.01 * static_cast<double>(i)}, 0.01, 0, 0, 7,
              Lidar);
  const DemLayers layers = fuse_all(points, frame).layers;
  const std::size_t under = 5 * 8 + 2;
  EXPECT_NEAR(layers.elevation_m[under], 1, 0.02);
  EXPECT_EQ(layers.surfaces[under], 2);
  EXPECT_EQ(layers.overhang_m[under], 3.5F);
  EXPECT_NEAR(layers.clearance_m[under], 2.5, 0.05);  // above the highest point of the ground
  EXPECT_LT(layers.clearance_m[under], 3.5F - layers.elevation_m[under]);
  EXPECT_EQ(layers.lidar[under], 10U);
  EXPECT_TRUE(std::isnan(layers.overhang_m[0]));
  EXPECT_TRUE(std::isnan(layers.clearance_m[0]));
  EXPECT_EQ(layers.surfaces[0], 1);
}

// One trunk has points from its foot to 4 m without a gap; another cell's trunk is seen only from
// 2.2 m up.
TEST(DemFusion, TrunksAreNotGround) {
  const GridFrame frame = frame_over({{0, 0}, {2, 2}}, 0.25);
  MeasuredPoints points = flat_ground(frame, 10);
  for (std::size_t i = 0; i < 200; ++i)
    add_point(points, {frame.to_D({3, 3}), 1 + 0.015 * static_cast<double>(i)}, 0.01, 0, 0, 7,
              Lidar);
  MeasuredPoints seen;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i < 640 && i % 64 == 2 * 8 + 6) continue;
    add_point(seen, points.p_m[i], points.sd_m[i], 0, 0, points.groups[i], Lidar);
  }
  for (std::size_t i = 0; i < 120; ++i)
    add_point(seen, {frame.to_D({6, 2}), 2.2 + 0.015 * static_cast<double>(i)}, 0.01, 0, 0, 7,
              Lidar);
  const Fusion fusion = fuse_all(seen, frame);
  EXPECT_NEAR(fusion.layers.elevation_m[3 * 8 + 3], 1, 0.05);
  EXPECT_EQ(fusion.layers.source[2 * 8 + 6], HeightSource::None);
  EXPECT_NEAR(fusion.layers.overhang_m[2 * 8 + 6], 2.2, 1e-5);
  EXPECT_NEAR(fusion.layers.clearance_m[2 * 8 + 6], 1.2, 0.05);  // above the surrounding ground
  EXPECT_EQ(fusion.counts.without_ground, 1U);
}

// Below a wall that begins above the ground and hides it: on a slope the clearance is that at the
// cell's upper edge.
TEST(DemFusion, ClearanceOnASlopeIsMeasuredFromTheHighestGround) {
  const GridFrame frame = frame_over({{0, 0}, {9, 9}}, 1);
  const glm::dvec2 hidden = frame.to_D({4, 4});
  const double base_m = 0.8 * hidden.x + 2;
  MeasuredPoints points;
  for (std::size_t i = 0; i < 800; ++i) {
    const glm::dvec2 p = uniform(i, 40) * 9.0;
    const glm::dvec2 off = glm::abs(p - hidden);
    if (std::max(off.x, off.y) < 0.5) continue;
    add_point(points, {p, 0.8 * p.x}, 0.005, 0, 0, 7, Lidar);
  }
  for (std::size_t i = 0; i < 80; ++i) {
    add_point(points, {hidden + uniform(i, 43) - 0.5, base_m + 0.05 * static_cast<double>(i)},
              0.005, 0, 0, 7, Lidar);
  }
  const Fusion fusion = fuse_all(points, frame);
  const std::size_t cell = 4 * static_cast<std::size_t>(frame.samples.x) + 4;
  EXPECT_NEAR(fusion.layers.overhang_m[cell], base_m, 1e-4);
  EXPECT_NEAR(fusion.layers.clearance_m[cell], 2 - 0.8 * 0.5, 0.02);
}

// Points treated as exact, as those of files without standard deviations are.
TEST(DemFusion, MountainsOfExactPointsAreFused) {
  const GridFrame frame = frame_over({{0, 0}, {3000, 3000}}, 100);
  MeasuredPoints points;
  for (std::size_t i = 0; i < 8000; ++i) {
    const glm::dvec2 p = uniform(i, 42) * 3000.0, cell = glm::floor(p / 100.0);
    const double peak_m = 60 * normal(static_cast<std::size_t>(cell.x + 30 * cell.y), 44).x;
    add_point(points, {p, 1000 + peak_m + 0.2 * p.x}, 0, 0, 0, 7, Lidar);
  }
  FusionOptions options;
  options.outlier_share = 0;
  options.steepest_slope = 10;
  options.surface_gap_m = 1000;
  const DemLayers layers = fuse_all(points, frame, options).layers;
  for (std::size_t i = 0; i < layers.source.size(); ++i) {
    const bool is_told = layers.source[i] != HeightSource::None;
    EXPECT_EQ(is_told, std::isfinite(layers.elevation_m[i]));
    EXPECT_EQ(is_told, std::isfinite(layers.variance_m2[i]));
  }
  EXPECT_GT(std::count(layers.source.begin(), layers.source.end(), HeightSource::Lidar), 880);
}

MeasuredPoints rolling_points(std::size_t count) {
  const testing::RollingGround ground(10, 10, 0, Seed{2});
  MeasuredPoints points;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec2 p = (uniform(i, 30) - 0.5) * 20.0;
    add_point(points, {p, ground.height_m(p) + 0.02 * normal(i, 31).x}, 0.02, 0.004, 0.01,
              static_cast<std::uint32_t>(i % 7), i % 7 < 3 ? Lidar : Stereo);
  }
  // Several points of the same height, which only their other columns distinguish.
  for (std::size_t i = 0; i < 300; ++i) points.p_m[i].z = points.p_m[i + 1].z = 0.5;
  return points;
}

TEST(DemFusion, SameDemForAnyOrderBlocksThreadsAndMemory) {
  const GridFrame frame = frame_over({{-10, -10}, {10, 10}}, 0.25);
  const MeasuredPoints points = rolling_points(60'000);
  const Fusion one = fuse_all(points, frame);
  EXPECT_EQ(one.counts.bytes_on_disk, 0U);
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [](std::size_t a, std::size_t b) { return uniform(a, 33).x < uniform(b, 33).x; });
  MeasuredPoints other;
  for (const std::size_t i : order) {
    add_point(other, points.p_m[i], points.sd_m[i], points.bias_sd_m[i], points.across_sd_m[i],
              points.groups[i], points.origins[i], points.lean[i]);
  }
  for (const std::size_t threads : {1U, 3U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    for (const std::size_t bytes :
         {std::size_t{1} << 30U, std::size_t{480'000}, std::size_t{300'000}}) {
      FusionOptions options;
      options.memory_bytes = bytes;
      const Fusion again = fuse(in_blocks(other, 977), frame, options);
      expect_same(one.layers, again.layers);
      EXPECT_EQ(again.counts.bytes_on_disk > 0, bytes < (1U << 30U));
    }
  }
}

TEST(DemFusion, TilesMatchTheUntiledDem) {
  const GridFrame frame = frame_over({{-10, -10}, {10, 10}}, 0.05);  // 400 x 400
  const MeasuredPoints points = rolling_points(100'000);
  const Fusion whole = fuse_all(points, frame);
  std::vector<std::uint8_t> covered(whole.layers.source.size());
  const auto check = [&](DemTile&& tile) {
    const GridFrame& part = tile.layers.frame;
    EXPECT_EQ(part.origin_m, frame.to_D(tile.first));
    for (int row = 0; row < part.samples.y; ++row) {
      for (int column = 0; column < part.samples.x; ++column) {
        const auto at = testing::number_of(part, {column, row});
        const auto in_whole = testing::number_of(frame, tile.first + glm::ivec2(column, row));
        ++covered[in_whole];
        ASSERT_EQ(tile.layers.source[at], whole.layers.source[in_whole]);
        if (tile.layers.source[at] == HeightSource::None) continue;
        ASSERT_EQ(tile.layers.elevation_m[at], whole.layers.elevation_m[in_whole]);
        ASSERT_EQ(tile.layers.variance_m2[at], whole.layers.variance_m2[in_whole]);
      }
    }
  };
  const FusionCounts counts = fuse(in_blocks(points, 5000), frame, {}, check);
  EXPECT_EQ(counts.points, points.size());
  EXPECT_THAT(covered, ::testing::Each(1));
}

TEST(DemFusion, NoPointsMakeAnUnmeasuredDem) {
  const GridFrame frame = frame_over({{0, 0}, {2, 2}}, 0.25);
  const Fusion fusion = fuse_all({}, frame);
  EXPECT_EQ(fusion.counts.points, 0U);
  EXPECT_THAT(fusion.layers.source, ::testing::Each(HeightSource::None));
  EXPECT_THAT(fusion.layers.elevation_m, ::testing::Each(::testing::IsNan()));
}

// A lone point may be an outlier, unless the outlier fraction is zero.
TEST(DemFusion, OnePointIsGroundIfTheOutlierShareIsZero) {
  const GridFrame frame = frame_over({{0, 0}, {2, 2}}, 0.25);
  MeasuredPoints points;
  add_point(points, {frame.to_D({3, 2}), 7}, 0.02, 0.01, 0, 0, Lidar);
  Fusion fusion = fuse_all(points, frame);
  EXPECT_EQ(fusion.counts.without_ground, 1U);
  EXPECT_THAT(fusion.layers.source, ::testing::Each(HeightSource::None));
  fusion = fuse_all(points, frame, {.outlier_share = 0});
  EXPECT_EQ(fusion.layers.source[2 * 8 + 3], HeightSource::Lidar);
  EXPECT_NEAR(fusion.layers.elevation_m[2 * 8 + 3], 7, 1e-5);
  EXPECT_NEAR(fusion.layers.variance_m2[2 * 8 + 3], 0.02 * 0.02 + 0.01 * 0.01, 1e-6);
  EXPECT_TRUE(std::isnan(fusion.layers.chi2[2 * 8 + 3]));
  EXPECT_NEAR(fusion.layers.to_data_m[16], 0.75, 1e-6);
}

// Half of the cells have points of 5 cm, the others of 1 cm: a limit of 2 cm keeps only the latter.
TEST(DemFusion, SamplesAboveTheSdLimitStayUnmeasured) {
  const GridFrame frame = frame_over({{0, 0}, {2, 2}}, 0.25);
  MeasuredPoints points = flat_ground(frame, 2);
  for (std::size_t i = 0; i < points.size(); ++i) points.sd_m[i] = i % 8 < 4 ? 0.01F : 0.05F;
  const Fusion all = fuse_all(points, frame, {.outlier_share = 0});
  const Fusion some = fuse_all(points, frame, {.outlier_share = 0, .most_sd_m = 0.02});
  EXPECT_EQ(all.counts.uncertain, 0U);
  EXPECT_EQ(some.counts.uncertain, 32U);
  EXPECT_EQ(some.counts.without_ground, 0U);
  for (std::size_t i = 0; i < 64; ++i) {
    EXPECT_EQ(some.layers.source[i], i % 8 < 4 ? HeightSource::Lidar : HeightSource::None);
    if (i % 8 < 4) {
      EXPECT_EQ(some.layers.elevation_m[i], all.layers.elevation_m[i]);
    }
  }
}

TEST(DemFusion, OutliersAloneMakeHardlyAnyGround) {
  const GridFrame frame = frame_over({{0, 0}, {10, 10}}, 0.25);
  MeasuredPoints points;
  for (std::size_t i = 0; i < 3200; ++i)
    add_point(points, {10.0 * uniform(i, 40), 100 * uniform(i, 41).x}, 0.02, 0, 0, 0, Lidar);
  const Fusion fusion = fuse_all(points, frame);
  const auto ground = 1600 - std::count(fusion.layers.source.begin(), fusion.layers.source.end(),
                                        HeightSource::None);
  EXPECT_LT(ground, 32);  // 2 % of the cells
}

TEST(DemFusion, CountsInvalidAndOutsidePoints) {
  const GridFrame frame = frame_over({{0, 0}, {2, 2}}, 0.25);
  MeasuredPoints points = flat_ground(frame, 4);
  const DemLayers clean = fuse_all(points, frame).layers;
  add_point(points, {nan, 1, 1}, nan, 0, 0, 0, Lidar);
  add_point(points, {1, 1, nan}, 0.01, 0, 0, 0, Lidar);
  add_point(points, {1, std::numeric_limits<double>::infinity(), 1}, 0.01, 0, 0, 0, Lidar);
  add_point(points, {1, 1, 1e6}, 0.01, 0, 0, 0, Lidar);
  add_point(points, {2, 1, 1}, 0.01, 0, 0, 0, Lidar);  // the upper borders do not belong to cells
  add_point(points, {-1e300, 1, 1}, 0.01, 0, 0, 0, Lidar);
  const Fusion fusion = fuse_all(points, frame);
  EXPECT_EQ(fusion.counts.unusable, 4U);
  EXPECT_EQ(fusion.counts.outside, 2U);
  EXPECT_EQ(fusion.counts.points, 262U);
  expect_same(clean, fusion.layers);
}

TEST(DemFusion, RejectsInvalidColumnsAndOptions) {
  const GridFrame frame = frame_over({{0, 0}, {2, 2}}, 0.25);
  MeasuredPoints points = flat_ground(frame, 1);
  points.sd_m[17] = -0.01F;
  points.across_sd_m[17] = std::numeric_limits<float>::quiet_NaN();
  expect_refusal([&] { fuse_all(points, frame); },
                 "measured point 17:\n  sd_m = -0.01 must be a number >= 0\n  across_sd_m = nan");
  points = flat_ground(frame, 1);
  points.groups[3] = 1U << 31U;
  expect_refusal([&] { fuse_all(points, frame); }, "group 2147483648 must be below 2^31");
  points.origins.pop_back();
  expect_refusal(
      [&] {
        fuse(
            [&, given = false](MeasuredPoints& block) mutable {
              block = points;
              return !std::exchange(given, true);
            },
            frame);
      },
      "columns must have the same length, but p_m has 64 entries");
  expect_refusal([&] { fuse_all({}, frame, {.outlier_share = 0.7}); },
                 "outlier_share = 0.7 must be 0 to 0.5");
  expect_refusal([&] { fuse_all({}, frame, {.surface_gap_m = nan}); }, "surface_gap_m = nan");
  expect_refusal([&] { fuse_all({}, frame, {.slope_sd = 0}); }, "slope_sd = 0 must be above 0");
  expect_refusal([&] { fuse_all({}, frame, {.most_sd_m = nan}); }, "most_sd_m = nan must be above");
  expect_refusal([&] { fuse_all({}, GridFrame{{1, 1}}); }, "must be at least 2 x 2");
  expect_refusal(
      [&] {
        fuse(in_blocks(points, 1), frame, {}, RunControl{.progress = {}, .most_bytes = 1000});
      },
      "a DEM of 8 x 8 samples takes");
}

TEST(DemFusion, ReportsFailedTemporaryFilesAndLeavesNone) {
  const GridFrame frame = frame_over({{-10, -10}, {10, 10}}, 0.25);
  const MeasuredPoints points = rolling_points(50'000);
  const testing::TemporaryFolder folder;
  FusionOptions options{.memory_bytes = 400'000, .folder = folder / "missing"};
  expect_refusal([&] { fuse_all(points, frame, options); }, "missing: No such file or directory");
  options.folder = folder.path();
  {
    const testing::FileSizeLimit limit(100'000);
    expect_refusal([&] { fuse_all(points, frame, options); }, "File too large; raise the limit");
  }
  const auto look = [&](DemTile&&) { EXPECT_TRUE(std::filesystem::is_empty(folder.path())); };
  fuse(in_blocks(points, 1000), frame, options, look);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(DemFusion, RejectsCellsWithTooManyPointsForTheMemory) {
  const GridFrame frame{{2, 2}, {0, 0}, {1, 1}, {1, 1}};
  MeasuredPoints points;
  for (std::size_t i = 0; i < 5000; ++i)
    add_point(points, {uniform(i, 50) - 0.5, 0.01 * normal(i, 51).x}, 0.01, 0, 0, 0, Lidar);
  expect_refusal([&] { fuse_all(points, frame, {.memory_bytes = 100'000}); },
                 "contain 5000 points, which take");
}

TEST(DemFusion, RejectsRastersWithTooManyTilesForTheMemory) {
  const GridFrame frame = frame_over({{0, 0}, {1e6, 1e6}}, 0.01);
  const MeasuredPoints none;
  expect_refusal([&] { fuse(in_blocks(none, 1), frame, {}, [](DemTile&&) {}); },
                 "a DEM of 100000000 x 100000000 samples is split into");
}

TEST(DemFusion, ExceptionsFromProgressStopTheFusion) {
  const GridFrame frame = frame_over({{0, 0}, {2, 2}}, 0.25);
  const MeasuredPoints points = flat_ground(frame, 4);
  double last = 0;
  fuse(in_blocks(points, 10), frame, {}, RunControl{.progress = [&](double share) {
         EXPECT_GE(share, last);
         last = share;
       }});
  EXPECT_EQ(last, 1);
  const auto stop = [](double) { throw std::runtime_error("enough"); };
  EXPECT_THROW(fuse(in_blocks(points, 10), frame, {}, RunControl{.progress = stop}),
               std::runtime_error);
}

}  // namespace
}  // namespace groundray::dem_fusion_test
