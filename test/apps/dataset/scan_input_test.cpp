#include "apps/dataset/scan_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/ply_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::scan_input_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)
using std::chrono::nanoseconds;

constexpr int rings = 8, steps = 120;
constexpr double sweep_s = 0.1;

// Pose of a sensor that moves at 10 m/s along D's x axis while it turns.
Pose pose_at(double t_s) {
  return {rotation_from_yaw_pitch_roll(0.4 * t_s, 0, 0), {10 * t_s, 0, 2}};
}

Trajectory path() {
  std::vector<Trajectory::Sample> samples;
  for (int i = 0; i <= 200; ++i)
    samples.push_back({std::chrono::milliseconds(i), pose_at(1e-3 * i)});
  return Trajectory(std::move(samples));
}

struct Return {
  glm::dvec3 p_S, p_D;  // at its firing time, and in D
  int ring = 0;
  double time_s = 0;
};

// Returns from a cylinder about D's z axis.
std::vector<Return> returns(double stamp_s) {
  std::vector<Return> out;
  for (int step = 0; step < steps; ++step) {
    for (int ring = 0; ring < rings; ++ring) {
      const double t_s = sweep_s * step / steps;
      const double a = 2 * std::numbers::pi * step / steps, e = 0.03 * ring - 0.1;
      const glm::dvec3 p_S =
          6. * glm::dvec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      out.push_back({p_S, pose_at(stamp_s + t_s) * p_S, ring, t_s});
    }
  }
  return out;
}

enum class In { S, Stamp };

// Writes a scan with its points in S at each firing time or all in S at the stamp.
void write_scan(
    const std::filesystem::path& path, const std::vector<Return>& all, double stamp_s, In frame,
    const std::vector<std::pair<std::string, std::function<double(std::size_t)>>>& more = {}) {
  PointCloud cloud(all.size());
  for (int axis = 0; axis < 3; ++axis) {
    const auto values = cloud.add<double>(std::string(1, "xyz"[axis]));
    for (std::size_t i = 0; i < all.size(); ++i)
      values[i] = (frame == In::S ? all[i].p_S : inverse(pose_at(stamp_s)) * all[i].p_D)[axis];
  }
  const auto ring = cloud.add<double>("ring");
  const auto time = cloud.add<float>("time");
  for (std::size_t i = 0; i < all.size(); ++i) {
    ring[i] = all[i].ring;
    time[i] = static_cast<float>(all[i].time_s);
  }
  for (const auto& [name, value] : more) {
    const auto values = cloud.add<double>(name);
    for (std::size_t i = 0; i < all.size(); ++i) values[i] = value(i);
  }
  write_ply(path, cloud, {});
}

ScanFiles files_of(const std::filesystem::path& path_of_scan, double stamp_s,
                   LidarSpec::Points points) {
  return {.scans = {{.name = "a",
                     .file = path_of_scan,
                     .X_DS = pose_at(stamp_s),
                     .path = 0,
                     .stamp = nanoseconds(std::llround(stamp_s * 1e9)),
                     .points = points,
                     .range_noise_sigma_m = 0.02}},
          .paths = {path()},
          .georeference = {},
          .notes = {}};
}

// Whichever of the two frames a file's points are in, the cells are the same: in D, with the origin
// of each beam.
TEST(ScanInput, PointsAsFiredAndAtTheStampYieldTheSameScan) {
  const TemporaryFolder folder;
  const double stamp_s = 0.05;
  const auto all = returns(stamp_s);
  for (const auto& [frame, points] :
       {std::pair(In::S, LidarSpec::Points::AsFired), {In::Stamp, LidarSpec::Points::AtStamp}}) {
    write_scan(folder / "a.ply", all, stamp_s, frame);
    const ScanFiles files = files_of(folder / "a.ply", stamp_s, points);
    const OrganisedInput made = read_organised(files, files.scans[0], {});
    EXPECT_EQ(made.rows, all.size());
    EXPECT_EQ(made.cells.rows, rings);
    EXPECT_EQ(made.cells.columns, steps);
    EXPECT_TRUE(made.cells.is_round);
    for (std::size_t i = 0; i < made.cells.points_m.size(); ++i) {
      const std::uint32_t row = made.cells.returns[i];
      ASSERT_NE(row, OrganisedScan::none);
      EXPECT_LT(glm::distance(made.cells.points_m[i], all[row].p_D), 1e-6);
      const glm::dvec3 origin_m = pose_at(stamp_s + all[row].time_s).translation_m;
      EXPECT_LT(glm::distance(made.cells.origins_m[i], origin_m), 1e-6);
      EXPECT_EQ(made.cells.sd_m[i], 0.02f);
    }
    const PointInput bare = read_points(files, files.scans[0], {});
    ASSERT_EQ(bare.points_m.size(), all.size());
    for (std::size_t i = 0; i < all.size(); ++i)
      EXPECT_LT(glm::distance(bare.points_m[i], all[i].p_D), 1e-6);
  }
}

// Without a path, the sensor has its pose at the stamp for the whole scan, and its points are taken
// in that pose.
TEST(ScanInput, WithoutATrajectoryThePoseIsConstant) {
  const TemporaryFolder folder;
  const auto all = returns(0);
  write_scan(folder / "a.ply", all, 0, In::Stamp);
  ScanFiles files = files_of(folder / "a.ply", 0, LidarSpec::Points::AtStamp);
  files.scans[0].path.reset();
  const OrganisedInput made = read_organised(files, files.scans[0], {});
  EXPECT_EQ(made.cells.rows, rings);
  for (std::size_t i = 0; i < made.cells.points_m.size(); ++i) {
    if (made.cells.returns[i] == OrganisedScan::none) continue;
    EXPECT_LT(glm::distance(made.cells.points_m[i], all[made.cells.returns[i]].p_D), 1e-6);
    EXPECT_EQ(made.cells.origins_m[i], pose_at(0).translation_m);
  }
}

TEST(ScanInput, KeepsStandardDeviationsAndLabels) {
  const TemporaryFolder folder;
  const auto all = returns(0);
  write_scan(folder / "a.ply", all, 0, In::S,
             {{"range_sd", [](std::size_t i) { return 0.001 * static_cast<double>(i % 5); }},
              {"label", [](std::size_t i) { return static_cast<double>(i % 3); }}});
  const ScanFiles files = files_of(folder / "a.ply", 0, LidarSpec::Points::AsFired);
  const OrganisedInput made = read_organised(files, files.scans[0], {});
  for (std::size_t i = 0; i < made.cells.points_m.size(); ++i) {
    EXPECT_NEAR(made.cells.sd_m[i], 0.001 * (made.cells.returns[i] % 5), 1e-9);
    EXPECT_EQ(made.cells.labels[i], made.cells.returns[i] % 3);
  }
  const OrganisedInput other =
      read_organised(files, files.scans[0], {.labels = LabelUse::Leave, .range_sd_m = 0.5});
  EXPECT_TRUE(other.cells.labels.empty());
  EXPECT_EQ(other.cells.sd_m[3], 0.5f);
}

TEST(ScanInput, ErrorsNameTheFile) {
  const TemporaryFolder folder;
  const auto all = returns(0);
  const auto refusal = [&](const ScanFiles& files, const ScanTaking& taking) -> std::string {
    try {
      read_organised(files, files.scans[0], taking);
    } catch (const Error& fault) {
      return fault.what();
    }
    return "";
  };
  write_scan(folder / "a.ply", all, 0, In::S);
  ScanFiles files = files_of(folder / "a.ply", 0, LidarSpec::Points::AsFired);
  EXPECT_THAT(refusal(files, {.grid = GridSource::File}),
              AllOf(HasSubstr("a.ply"), HasSubstr("points arranged as an image")));
  EXPECT_THAT(refusal(files, {.returns = ReturnChoice::Strongest}),
              AllOf(HasSubstr("a.ply"), HasSubstr("there is no intensity")));
  files.scans[0].stamp = std::chrono::seconds(5);
  EXPECT_THAT(refusal(files, {}), AllOf(HasSubstr("a.ply"), HasSubstr("--time-zero-s")));
  const std::vector<std::pair<std::string, double>> bad{
      {"range_sd", -1}, {"range_sd", std::numeric_limits<double>::infinity()},
      {"label", 0.5},   {"label", 70000},
      {"column", 1e10}, {"column", 0.5}};
  for (const auto& [name, value] : bad) {
    write_scan(folder / "a.ply", all, 0, In::S,
               {{name, [bad_value = value](std::size_t i) { return i == 7 ? bad_value : 1; }}});
    files = files_of(folder / "a.ply", 0, LidarSpec::Points::AsFired);
    EXPECT_THAT(refusal(files, {}), AllOf(HasSubstr("a.ply"), HasSubstr("row 7"))) << name;
  }
}

// Points without a grid are rejected with a message that names the option that accepts them.
TEST(ScanInput, SuggestsUnorganisedForCloudsWithoutAGrid) {
  const TemporaryFolder folder;
  PointCloud cloud(2000);
  for (const std::string name : {"x", "y", "z"}) {
    const auto values = cloud.add<double>(name);
    for (std::size_t i = 0; i < 2000; ++i)
      values[i] = std::sin(static_cast<double>(i * i + 1) * (name == "x"   ? 1.3
                                                             : name == "y" ? 2.7
                                                                           : 4.1));
  }
  write_ply(folder / "a.ply", cloud, {});
  const ScanFiles files{.scans = {{.name = "a", .file = folder / "a.ply"}},
                        .paths = {},
                        .georeference = {},
                        .notes = {}};
  try {
    read_organised(files, files.scans[0], {});
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(),
                AllOf(HasSubstr("a.ply"), HasSubstr("without order (--unorganised)")));
  }
  EXPECT_EQ(read_points(files, files.scans[0], {}).points_m.size(), 2000u);
}

}  // namespace
}  // namespace groundray::scan_input_test
