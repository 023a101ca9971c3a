#include "apps/groundray/dem/dem_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/ply_io.h"
#include "reconstruction/dem/fill/sight_bound.h"
#include "test/support/temporary_folder.h"

namespace groundray::dem_input_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)
using std::chrono::milliseconds;

constexpr double eye_height_m = 3;

using Columns = std::vector<std::pair<std::string, std::vector<double>>>;

void write_scan(const std::filesystem::path& path, const std::vector<glm::dvec3>& points_m,
                const Columns& more = {}) {
  PointCloud cloud(points_m.size());
  for (int axis = 0; axis < 3; ++axis) {
    const auto values = cloud.add<double>(std::string(1, "xyz"[axis]));
    for (std::size_t i = 0; i < points_m.size(); ++i) values[i] = points_m[i][axis];
  }
  for (const auto& [name, numbers] : more) {
    const auto values = cloud.add<double>(name);
    std::ranges::copy(numbers, values.begin());
  }
  write_ply(path, cloud, {});
}

ScanFiles files_of(const std::filesystem::path& path) {
  return {.scans = {{.name = "a", .file = path, .X_DS = {.translation_m = {0, 0, eye_height_m}}}},
          .paths = {},
          .georeference = {}};
}

// Returns the blocks of all scans.
std::vector<LidarBlock> blocks_of(const ScanFiles& files, const ScanTaking& taking,
                                  const MeasurementNoise& noise) {
  DemRequest request{.choice = {}, .taking = taking, .noise = noise};
  for (const ScanFile& scan : files.scans) request.choice.inputs.push_back(scan.file);
  StageProgress progress;
  DemInput input(request, files, {}, progress);
  std::vector<LidarBlock> blocks;
  input.rewind_to_scans();
  for (LidarBlock block; input.next(block);) blocks.push_back(block);
  return blocks;
}

MeasuredPoints all_of(const ScanFiles& files, const ScanTaking& taking,
                      const MeasurementNoise& noise) {
  const std::vector<LidarBlock> blocks = blocks_of(files, taking, noise);
  EXPECT_THAT(blocks, SizeIs(1));
  return blocks.front().points;
}

std::vector<glm::dvec3> ends_of_beams() {
  return {{4, 0, -eye_height_m},
          {0, 30, -eye_height_m},
          {7, -9, -eye_height_m},
          {0.1, 0, -eye_height_m},
          {12, 5, 0},
          {3, 4, 6}};
}

struct Spread {
  double height_m = 0, across_m = 0;
};

// Draws errors of a point and measures their standard deviations: in height, and in each horizontal
// direction.
Spread drawn(const std::function<glm::dvec3(std::function<double()>)>& error_m) {
  constexpr int draws = 40'000;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  double up_m2 = 0, flat_m2 = 0;
  for (int i = 0; i < draws; ++i) {
    const glm::dvec3 e = error_m([&] { return normal(random); });
    up_m2 += e.z * e.z;
    flat_m2 += (e.x * e.x + e.y * e.y) / 2;
  }
  return {std::sqrt(up_m2 / draws), std::sqrt(flat_m2 / draws)};
}

// The relative standard deviation of a variance of n draws is sqrt(2 / n), that of a standard
// deviation half of it. The tolerance is five times that.
constexpr double share = 5 * 0.0036;

// The oracle draws errors along and across the beam and does not use the formulas under test.
TEST(DemInput, PropagatesRangeAndBeamNoiseToHeightsAndPositions) {
  const TemporaryFolder folder;
  constexpr double range_sd_m = 0.03, divergence_rad = 0.012;
  const auto ends_m = ends_of_beams();
  write_scan(folder / "a.ply", ends_m);
  const ScanFiles files = files_of(folder / "a.ply");
  const ScanTaking taking{.range_sd_m = range_sd_m};
  const auto points = all_of(files, taking, {.points = {.divergence_rad = divergence_rad}});
  ASSERT_THAT(points.p_m, SizeIs(ends_m.size()));
  for (std::size_t i = 0; i < ends_m.size(); ++i) {
    const double range_m = glm::length(ends_m[i]);
    const glm::dvec3 d = ends_m[i] / range_m;
    const glm::dvec3 side = glm::normalize(glm::cross(d, glm::dvec3(0.3, 0.5, 0.8)));
    const glm::dvec3 other = glm::cross(d, side);
    // The beam's profile exp(-2 (w / w0)^2) makes its 1/e^2 radius w0 two standard deviations.
    const double foot_m = range_m * (divergence_rad / 2) / 2;
    const Spread spread = drawn([&](const auto& normal) {
      return range_sd_m * normal() * d + foot_m * (normal() * side + normal() * other);
    });
    EXPECT_NEAR(points.sd_m[i], spread.height_m, share * spread.height_m) << i;
    // The horizontal error has a part that is correlated with the height (`lean`) and an
    // independent rest.
    const double leaning_m = glm::length(points.lean[i]) * points.sd_m[i] / std::sqrt(2.0);
    EXPECT_NEAR(std::hypot(points.across_sd_m[i], leaning_m), spread.across_m,
                share * spread.across_m)
        << i;
    // Height error on ground that rises along the beam.
    const glm::dvec2 ahead = glm::dvec2(d) / std::max(1e-9, glm::length(glm::dvec2(d)));
    const double slope = 0.5;
    const Spread tilted = drawn([&](const auto& normal) {
      const glm::dvec3 e =
          range_sd_m * normal() * d + foot_m * (normal() * side + normal() * other);
      return glm::dvec3(0, 0, e.z - slope * glm::dot(ahead, glm::dvec2(e)));
    });
    // The points hold only the mean of the rest over both horizontal directions, so the true value
    // lies between these two bounds.
    const double tilt = 1 - slope * glm::dot(ahead, glm::dvec2(points.lean[i]));
    const double told_m = std::abs(points.sd_m[i] * tilt);
    EXPECT_LE(told_m, (1 + share) * tilted.height_m) << i;
    EXPECT_GE(std::hypot(told_m, slope * std::sqrt(2.0) * points.across_sd_m[i]),
              (1 - share) * tilted.height_m)
        << i;
    EXPECT_EQ(points.bias_sd_m[i], 0);
  }
}

TEST(DemInput, PoseErrorsBecomeACommonBias) {
  const TemporaryFolder folder;
  const auto ends_m = ends_of_beams();
  write_scan(folder / "a.ply", ends_m);
  ScanFiles files = files_of(folder / "a.ply");
  files.scans.resize(8, files.scans[0]);
  const PointNoise noise{.position_sd_m = 0.05, .attitude_sd_rad = 0.004};
  const MeasuredPoints points = blocks_of(files, {}, {.points = noise})[7].points;
  for (std::size_t i = 0; i < ends_m.size(); ++i) {
    const Spread spread = drawn([&](const auto& normal) {
      const glm::dvec3 turn = noise.attitude_sd_rad * glm::dvec3(normal(), normal(), normal());
      const glm::dvec3 moved = noise.position_sd_m * glm::dvec3(normal(), normal(), normal());
      return moved + glm::cross(turn, ends_m[i]);
    });
    EXPECT_NEAR(points.bias_sd_m[i], spread.height_m, share * spread.height_m) << i;
    EXPECT_EQ(points.sd_m[i], 0);
    EXPECT_EQ(points.groups[i], 7U);
  }
}

TEST(DemInput, AirborneRangeNoiseIsHeightNoise) {
  const TemporaryFolder folder;
  write_scan(folder / "a.ply", {{600'000, 5'000'000, 240}});
  ScanFiles files = files_of(folder / "a.ply");
  files.scans[0].X_DS = {};
  files.are_posed = false;
  const ScanTaking taking{.range_sd_m = 0.04};
  PointNoise noise{.beams = BeamOrigin::Above, .position_sd_m = 0.2, .across_sd_m = 0.3};
  const auto points = all_of(files, taking, {.points = noise});
  EXPECT_THAT(points.sd_m, ElementsAre(0.04f));
  EXPECT_THAT(points.bias_sd_m, ElementsAre(0.2f));
  EXPECT_THAT(points.across_sd_m, ElementsAre(0.3f));
  // Beams would have to start at a sensor at the origin of the map.
  noise.beams = BeamOrigin::Sensor;
  EXPECT_THAT(([&] { blocks_of(files, taking, {.points = noise}); }),
              ::testing::ThrowsMessage<Error>(HasSubstr("Add --airborne or --poses")));
}

// Poses every 10 ms from 0 to 300 ms, except for a gap.
ScanFiles with_gap(const std::filesystem::path& file, int from_ms, int to_ms) {
  ScanFiles files = files_of(file);
  std::vector<Trajectory::Sample> samples;
  for (int ms = 0; ms <= 300; ms += 10) {
    if (from_ms < ms && ms < to_ms) continue;
    samples.push_back({milliseconds(ms), {.translation_m = {0.01 * ms, 0, eye_height_m}}});
  }
  files.paths.emplace_back(std::move(samples));
  files.scans[0].path = 0;
  files.scans[0].stamp = milliseconds(100);
  return files;
}

// The scan lasts from 100 to 200 ms; checking only the interval that contains the stamp would miss
// most gaps.
TEST(DemInput, RejectsPoseGapsAnywhereInAScan) {
  const TemporaryFolder folder;
  write_scan(folder / "a.ply", {{4, 0, -3}, {0, 4, -3}, {4, 4, -3}}, {{"time", {0, 0.05, 0.1}}});
  const MeasurementNoise noise{.points = {}, .longest_pose_gap_s = 0.025};
  const auto read = [&](int from_ms, int to_ms) {
    return all_of(with_gap(folder / "a.ply", from_ms, to_ms), {}, noise).size();
  };
  for (const auto& [from_ms, to_ms] : {std::pair(110, 140), {170, 210}, {50, 250}, {80, 120}}) {
    EXPECT_THAT(([&, from = from_ms, to = to_ms] { read(from, to); }),
                ::testing::ThrowsMessage<Error>(HasSubstr("the poses have a gap")))
        << from_ms;
  }
  for (const auto& [from_ms, to_ms] : {std::pair(40, 90), {210, 260}, {130, 150}})
    EXPECT_EQ(read(from_ms, to_ms), 3U) << from_ms;
}

TEST(DemInput, TakesOneReturnPerPulse) {
  const TemporaryFolder folder;
  const std::vector<glm::dvec3> points_m{
      {1, 0, -1}, {2, 0, -2}, {3, 0, -3}, {0, 1, -1}, {0, 2, -2}};
  const Columns returns{{"intensity", {0.1, 0.9, 0.2, 0.5, 0.3}},
                        {"return_index", {1, 2, 3, 1, 2}}};
  const Columns pulses{{"pulse", {4, 4, 4, 9, 9}}};
  const Columns firings{{"ring", {0, 0, 0, 1, 1}}, {"time", {0.5, 0.5, 0.5, 0.5, 0.5}}};
  const auto heights_m = [&](const Columns& keys, ReturnChoice choice) {
    Columns all = returns;
    all.insert(all.end(), keys.begin(), keys.end());
    write_scan(folder / "a.ply", points_m, all);
    ScanFiles files = files_of(folder / "a.ply");
    files.scans[0].X_DS = {};
    std::vector<double> z_m;
    const ScanTaking taking{.returns = choice};
    for (const glm::dvec3& p : all_of(files, taking, {}).p_m) z_m.push_back(p.z);
    return z_m;
  };
  for (const Columns& keys : {pulses, firings}) {
    EXPECT_THAT(heights_m(keys, ReturnChoice::First), ElementsAre(-1, -1));
    EXPECT_THAT(heights_m(keys, ReturnChoice::Last), ElementsAre(-3, -2));
    EXPECT_THAT(heights_m(keys, ReturnChoice::Strongest), ElementsAre(-2, -1));
  }
  EXPECT_THAT(heights_m({}, ReturnChoice::First), SizeIs(5));  // pulses unknown: all are kept
}

TEST(DemInput, BlocksContainAllPointsOfTheFile) {
  const TemporaryFolder folder;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> anywhere(-50, 50);
  std::vector<glm::dvec3> points_m;
  std::vector<double> sd_m;
  for (int i = 0; i < 1000; ++i) {
    points_m.emplace_back(anywhere(random), anywhere(random), anywhere(random));
    sd_m.push_back(0.01 + 1e-5 * i);
  }
  points_m[500] = glm::dvec3(std::numeric_limits<double>::quiet_NaN());
  write_scan(folder / "a.ply", points_m, {{"range_sd", sd_m}});
  const ScanFiles files = files_of(folder / "a.ply");
  const PointInput whole = read_points(files, files.scans[0], {});
  constexpr std::size_t row_bytes = 32;
  PointReader reader(files, files.scans[0], {}, 300 * row_bytes);
  PointInput all;
  std::size_t blocks = 0;
  for (PointInput block; reader.next(block); ++blocks) {
    all.rows += block.rows;
    all.points_m.insert(all.points_m.end(), block.points_m.begin(), block.points_m.end());
    all.sd_m.insert(all.sd_m.end(), block.sd_m.begin(), block.sd_m.end());
  }
  EXPECT_EQ(blocks, 4U);
  EXPECT_EQ(all.rows, 1000U);
  EXPECT_EQ(all.points_m, whole.points_m);
  EXPECT_EQ(all.sd_m, whole.sd_m);
}

TEST(DemInput, ChecksMemoryForFilesThatCannotBeReadInBlocks) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.ply")
      << "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n"
         "property float y\nproperty float z\nend_header\n1 2 3\n4 5 6\n";
  const ScanFiles files = files_of(folder / "a.ply");
  const ScanTaking taking{.most_bytes = 100};
  EXPECT_THAT(([&] { blocks_of(files, taking, {}); }),
              ::testing::ThrowsMessage<Error>(HasSubstr("cannot be read in blocks")));
}

DemLayers flat_layers() {
  DemLayers layers = unknown_layers({.samples = {80, 60}, .origin_m = {-40, -20}});
  for (float& height_m : layers.elevation_m) height_m = 0;
  for (float& variance_m2 : layers.variance_m2) variance_m2 = 0;
  return layers;
}

// Each line of sight rises by two standard deviations of its own point; samples elsewhere stay
// unbounded.
TEST(DemSight, RaisesLinesByTheErrorsOfTheirPoints) {
  const TemporaryFolder folder;
  write_scan(folder / "a.ply", {{20, 3, -eye_height_m}, {-9, 15, -eye_height_m}});
  const ScanFiles files = files_of(folder / "a.ply");
  const ScanTaking taking{.range_sd_m = 0.1};
  const PointNoise noise{.position_sd_m = 0.3, .attitude_sd_rad = 0.01};
  constexpr double margin_m = 0.25;
  DemLayers layers = flat_layers();
  const LidarBlock block = blocks_of(files, taking, {.points = noise}).front();
  const MeasuredPoints& points = block.points;
  std::vector<SightLine> lines;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec3 up_m(0, 0, 2 * std::hypot(points.sd_m[i], points.bias_sd_m[i]));
    EXPECT_GT(up_m.z, 0.6);
    lines.push_back({glm::dvec3(0, 0, eye_height_m) + up_m, points.p_m[i] + up_m});
  }
  const auto expected_m = sight_bound(layers.frame, {}, lines, margin_m);
  bound_by_sight(block, margin_m, layers);
  std::size_t bound = 0;
  for (std::size_t i = 0; i < expected_m.size(); ++i) {
    ASSERT_EQ(std::isnan(layers.upper_bound_m[i]), std::isnan(expected_m[i])) << i;
    if (std::isnan(expected_m[i])) continue;
    ++bound;
    EXPECT_NEAR(layers.upper_bound_m[i], expected_m[i], 1e-5) << i;
  }
  EXPECT_GT(bound, 30U);
}

}  // namespace
}  // namespace groundray::dem_input_test
