#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <random>
#include <set>
#include <tuple>

#include "core/io/pcd_reader.h"
#include "reconstruction/dem/ground/ground_filter.h"
#include "test/support/machine_speed.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::ground_filter_proof_test {
namespace {

using testing::record_margin;
using testing::shared_data_folder;
using testing::slowness;

// Site of the ISPRS filter test (Sithole and Vosselman 2004), as distributed with the Point Cloud
// Library: northings as floats, in steps of 0.5 m.
struct Site {
  const char* name;
  double cloth_total;           // published for CSF: Zhang et al. (2016), table 3; per cent
  GroundFilterOptions options;  // best for the site, as the papers choose theirs
};

constexpr std::array sites{
    Site{
        "11", 12.01, {.slope = 0.13, .window_radius_m = 16, .threshold_m = 0.45, .scaling_m = 1.4}},
    Site{"51", 3.08, {.slope = 0.05, .window_radius_m = 18, .threshold_m = 0.4, .scaling_m = 0.9}},
    Site{"52", 3.93, {.slope = 0.14, .window_radius_m = 13, .threshold_m = 0.4, .scaling_m = 2.8}},
    Site{"53", 5.2, {.slope = 0.57, .window_radius_m = 3, .threshold_m = 0.05, .scaling_m = 3.9}},
    Site{"54", 3.18, {.slope = 0.05, .window_radius_m = 13, .threshold_m = 0.1, .scaling_m = 2.3}},
    Site{"61", 1.49, {.slope = 0.27, .window_radius_m = 5, .threshold_m = 0.45, .scaling_m = 1.45}},
    Site{"71", 5.71, {.slope = 0.13, .window_radius_m = 17, .threshold_m = 0.85, .scaling_m = 0}}};

std::vector<glm::dvec3> points_of(const std::filesystem::path& path) {
  const PointCloud cloud = read_pcd(path).cloud;
  const auto x = cloud.column<float>("x"), y = cloud.column<float>("y"),
             z = cloud.column<float>("z");
  std::vector<glm::dvec3> points_m;
  for (std::size_t i = 0; i < cloud.rows(); ++i) points_m.emplace_back(x[i], y[i], z[i]);
  return points_m;
}

struct LabelledPoints {
  std::vector<glm::dvec3> points_m;
  std::vector<bool> is_ground;  // labelled by hand
};

LabelledPoints labelled(const std::filesystem::path& folder, const std::string& site) {
  const std::string name = "samp" + site + "-utm";
  LabelledPoints points{.points_m = points_of(folder / (name + ".pcd"))};
  std::multiset<std::tuple<double, double, double>> ground;
  for (const glm::dvec3& p : points_of(folder / (name + "-ground.pcd")))
    ground.emplace(p.x, p.y, p.z);
  for (const glm::dvec3& p : points.points_m) {
    const auto found = ground.find({p.x, p.y, p.z});
    points.is_ground.push_back(found != ground.end());
    if (found != ground.end()) ground.erase(found);
  }
  EXPECT_TRUE(ground.empty()) << site;
  return points;
}

// Errors in per cent of the ground points, of the other points, and of all points.
struct Score {
  double type_i = 0, type_ii = 0, total = 0;
};

Score score_of(const LabelledPoints& truth, const GroundFilterOptions& options) {
  const GroundPoints found = filter_ground(truth.points_m, options);
  double ground = 0, missed = 0, taken = 0;
  const auto all = static_cast<double>(truth.points_m.size());
  for (std::size_t i = 0; i < truth.points_m.size(); ++i) {
    const bool is_taken = found.classes[i] == GroundClass::Ground;
    ground += truth.is_ground[i];
    missed += truth.is_ground[i] && !is_taken;
    taken += !truth.is_ground[i] && is_taken;
  }
  return {100 * missed / ground, 100 * taken / (all - ground), 100 * (missed + taken) / all};
}

void record(const std::string& key, const Score& score) {
  ::testing::Test::RecordProperty(
      key, fmt::format("type I {:.2f} type II {:.2f} total {:.2f} per cent", score.type_i,
                       score.type_ii, score.total));
}

// With options chosen for each site, as in the papers, the published means over all 15 sites (7 of
// them here) are 2.97 for SMRF, 4.39 for CSF and 4.82 for Axelsson's densified network (Zhang et
// al. 2016, table 4). With one set for all sites, the limit is CSF's mean over these 7.
TEST(GroundFilterProof, IsprsSitesHaveThePublishedErrors) {
  const auto folder = shared_data_folder() / "lidar/isprs_filtertest";
  if (!exists(folder / "samp11-utm.pcd"))
    GTEST_SKIP() << "there are no sites in " << folder << "; set GROUNDRAY_SHARED_DATA";
  double one_set = 0, chosen = 0, cloth = 0;
  for (const Site& site : sites) {
    const LabelledPoints truth = labelled(folder, site.name);
    const Score plain = score_of(truth, {}), best = score_of(truth, site.options);
    const std::string name = fmt::format("samp{}", site.name);
    record(name + ", one set", plain);
    record(name + ", chosen", best);
    EXPECT_LE(best.total, plain.total) << name;
    record_margin("total error of the ground filter at ISPRS " + name, best.total, site.cloth_total,
                  "per cent");
    one_set += plain.total / sites.size();
    chosen += best.total / sites.size();
    cloth += site.cloth_total / sites.size();
  }
  EXPECT_LE(chosen, 2.97);
  EXPECT_LE(one_set, cloth);
  record_margin("mean total error of the ground filter, options chosen for each ISPRS site", chosen,
                2.97, "per cent");
  record_margin("mean total error of the ground filter, one set for all ISPRS sites", one_set,
                cloth, "per cent");
}

// Hills under trees, four points per cell.
TEST(GroundFilterProof, FiltersMillionsOfPointsPerSecond) {
  const std::size_t count = testing::proof_size(400'000, 20'000'000);
  const double side_m = std::sqrt(static_cast<double>(count) / 4);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<glm::dvec3> points_m(count);
  std::vector<bool> is_ground(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = side_m * uniform(random), y = side_m * uniform(random);
    is_ground[i] = uniform(random) < 0.7;
    const double above_m = is_ground[i] ? 0 : 2 + 10 * uniform(random);
    points_m[i] = {x, y, 10 * std::sin(x / 40) + 8 * std::cos(y / 50) + above_m};
  }
  const std::clock_t begin = std::clock();
  const GroundPoints found = filter_ground(points_m);
  const double cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < count; ++i)
    wrong += is_ground[i] != (found.classes[i] == GroundClass::Ground);
  EXPECT_LE(static_cast<double>(wrong), 1e-3 * static_cast<double>(count));
  const double per_point_us = 1e6 * cpu_s / static_cast<double>(count);
  const double most_us = 0.5 * slowness();
  EXPECT_LE(per_point_us, most_us);
  record_margin("CPU time of the ground filter a point", per_point_us, most_us, "us");
}

}  // namespace
}  // namespace groundray::ground_filter_proof_test
