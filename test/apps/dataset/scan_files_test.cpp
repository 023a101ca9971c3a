#include "apps/dataset/scan_files.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::scan_files_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

std::filesystem::path write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path) << text;
  return path;
}

std::string refusal(const ScanChoice& choice) {
  try {
    find_scans(choice);
  } catch (const Error& fault) {
    return fault.what();
  }
  return "";
}

TEST(FrameRange, ParsesBeginEndAndStep) {
  const auto taken = [](const std::string& text) {
    const FrameRange range = parse_frames(text);
    std::vector<std::size_t> numbers;
    for (std::size_t i = 0; i < 10; ++i) {
      if (range.contains(i)) numbers.push_back(i);
    }
    return numbers;
  };
  using Numbers = std::vector<std::size_t>;
  EXPECT_EQ(taken("3"), Numbers{3});
  EXPECT_EQ(taken("2:5"), (Numbers{2, 3, 4}));
  EXPECT_EQ(taken("7:"), (Numbers{7, 8, 9}));
  EXPECT_EQ(taken(":2"), (Numbers{0, 1}));
  EXPECT_EQ(taken("1::4"), (Numbers{1, 5, 9}));
  EXPECT_EQ(taken(":"), taken("::"));
  for (const std::string text :
       {"", "x", "1:2:3:4", "5:5", "6:2", "1:9:0", "-1", "1.5", "0:99999999999999999999", " 1"})
    EXPECT_THROW(parse_frames(text), Error) << text;
}

// The greatest number of 64 bits cannot be a frame, because no end can follow it; the number before
// it can.
TEST(FrameRange, RejectsTheLargest64BitNumber) {
  EXPECT_THROW(parse_frames("18446744073709551615"), Error);
  EXPECT_EQ(parse_frames("18446744073709551614").end, 18446744073709551615u);
}

TEST(ScanFiles, ReadsScansListedInAConf) {
  const TemporaryFolder folder;
  write(folder / "a.ply", "ply\nelement range_grid 4\nend_header\n");
  write(folder / "b.ply.gz", "");
  write(folder / "c.ply", "ply\nelement vertex 4\nend_header\nelement range_grid 4\n");
  const auto conf = write(folder / "abc.conf",
                          "bmesh a.ply 1 2 3 0 0 0 1\nbmesh b.ply 0 0 0 0 0 0 1\n"
                          "bmesh c.ply 0 0 5 0 0 0 1\n");
  const ScanFiles files = find_scans({.inputs = {conf}, .conf_unit_m = 0.001});
  ASSERT_EQ(files.scans.size(), 3u);
  EXPECT_EQ(files.scans[0].file, folder / "a.ply");
  EXPECT_NEAR(glm::distance(files.scans[0].X_DS.translation_m, glm::dvec3(0.001, 0.002, 0.003)), 0,
              1e-15);
  EXPECT_TRUE(files.scans[0].is_range_grid);
  EXPECT_EQ(files.scans[1].name, "b.ply");
  EXPECT_EQ(files.scans[1].file, folder / "b.ply.gz") << "as Stanford packs them";
  EXPECT_TRUE(files.scans[1].is_range_grid);
  EXPECT_FALSE(files.scans[2].is_range_grid);
  const ScanFiles some = find_scans({.inputs = {conf}, .frames = parse_frames("::2")});
  ASSERT_EQ(some.scans.size(), 2u);
  EXPECT_EQ(some.scans[1].name, "c.ply");
  EXPECT_THAT(refusal({.inputs = {conf}, .frames = parse_frames("3:")}),
              HasSubstr("no scan among the requested frames"));
  EXPECT_THAT(refusal({.inputs = {conf}, .poses = conf}), HasSubstr("has poses of its own"));
  EXPECT_THAT(refusal({.inputs = {conf, folder / "a.ply"}}), HasSubstr("must be the only input"));
}

// Writes a dataset with one camera, or with one lidar whose second scan is still pending.
TEST(ScanFiles, LidarIsOptionalWhereStereoPairsAreUsed) {
  const TemporaryFolder folder;
  const auto dataset_of = [&](const std::string& kind) {
    write(folder / "dataset.yaml",
          fmt::format("groundray_dataset: 1\norigin_w_m: [1, 2, 0]\n"
                      "sensors: [{{name: top, kind: {}}}]\n"
                      "frames:\n  - {{sensor: top, frame: 0, stamp_s: 0, state: done}}\n"
                      "  - {{sensor: top, frame: 1, stamp_s: 0.1, state: pending}}\n",
                      kind));
  };
  const std::vector<std::filesystem::path> inputs{folder.path()};
  dataset_of("camera");
  EXPECT_THAT(refusal({.inputs = inputs}), HasSubstr("the dataset has no lidar"));
  const ScanFiles none = find_scans({.inputs = inputs, .need = ScanNeed::IfThere});
  EXPECT_TRUE(none.scans.empty());
  EXPECT_EQ(none.georeference.origin_w_m, glm::dvec3(1, 2, 0));
  EXPECT_THAT(refusal({.inputs = inputs, .need = ScanNeed::IfThere, .sensors = {"top"}}),
              HasSubstr("it has no lidar 'top'; it has: none"));
  EXPECT_THAT(refusal({.inputs = inputs, .need = ScanNeed::IfThere, .poses = "p.tum"}),
              HasSubstr("the dataset has no lidar"));
  dataset_of("lidar");  // no file with the lidar's poses or specification
  EXPECT_TRUE(find_scans({.inputs = inputs, .need = ScanNeed::None}).scans.empty());
  EXPECT_THAT(refusal({.inputs = inputs, .need = ScanNeed::IfThere}), HasSubstr("top.tum"));
  std::filesystem::create_directories(folder / "poses");
  std::filesystem::create_directories(folder / "calibration");
  write(folder / "poses/top.tum", "0 1 2 3 0 0 0 1\n0.5 2 2 3 0 0 0 1\n");
  write(folder / "calibration/top.yaml", "range_noise_sigma_m: 0.02\n");
  EXPECT_EQ(find_scans({.inputs = inputs, .need = ScanNeed::IfThere}).scans.size(), 1u);
  EXPECT_THAT(refusal({.inputs = inputs, .need = ScanNeed::IfThere, .frames = parse_frames("1:")}),
              AllOf(HasSubstr("no scan among the requested frames; top: 1 frames are pending"),
                    HasSubstr("--no-lidar")));
  EXPECT_THAT(refusal({.inputs = inputs, .need = ScanNeed::None, .sensors = {"top"}}),
              HasSubstr("--no-lidar: --sensor"));
  const auto scan = write(folder / "a.pcd", "");
  EXPECT_THAT(refusal({.inputs = {scan}, .need = ScanNeed::None}),
              HasSubstr("only a dataset has stereo pairs"));
}

TEST(ScanFiles, AssignsPosesToScansByLine) {
  const TemporaryFolder folder;
  const auto a = write(folder / "a.pcd", ""), b = write(folder / "b.pcd", "");
  const auto poses = write(folder / "p.tum", "0 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n");
  const ScanFiles files = find_scans({.inputs = {a, b}, .poses = poses});
  ASSERT_EQ(files.scans.size(), 2u);
  EXPECT_EQ(files.scans[0].X_DS.translation_m.x, 1);
  EXPECT_EQ(files.scans[1].X_DS.translation_m.x, 2);
  EXPECT_FALSE(files.scans[0].path) << "times of a line tell nothing of times in a scan";
  EXPECT_EQ(files.georeference.origin_w_m, glm::dvec3(0));
  EXPECT_THAT(refusal({.inputs = {a, b, a}, .poses = poses}), HasSubstr("2 poses for 3 scans"));
  EXPECT_THAT(refusal({.inputs = {a, b}}), HasSubstr("2 scans and no poses"));
  EXPECT_THAT(refusal({.inputs = {a}, .points = LidarSpec::Points::AsFired}),
              HasSubstr("each point needs its own pose"));
  EXPECT_THAT(refusal({.inputs = {a}, .sensors = {"top"}}), HasSubstr("only datasets have"));
  EXPECT_THAT(refusal({.inputs = {folder / "none.pcd"}}), HasSubstr("no such file"));
  EXPECT_THAT(refusal({.inputs = {folder.path()}}), HasSubstr("contains no dataset.yaml"));
  const ScanFiles alone = find_scans({.inputs = {a}});
  EXPECT_EQ(alone.scans.at(0).X_DS, Pose{});
  EXPECT_FALSE(alone.are_posed);
}

TEST(ScanFiles, ReadsStampsFromFileNames) {
  const TemporaryFolder folder;
  const auto poses =
      write(folder / "p.tum", "1317354879.0 0 0 0 0 0 0 1\n1317354880.0 8 0 0 0 0 0 1\n");
  const std::vector<std::pair<std::string, double>> names{{"1317354879.25.pcd", 2},
                                                          {"1317354879500000000.pcd", 4},
                                                          {"1317354880.pcd", 8},
                                                          {"1317354879.1250000001.pcd", 1}};
  for (const auto& [name, x_m] : names) {
    const ScanFiles files = find_scans(
        {.inputs = {write(folder / name, "")}, .poses = poses, .order = PoseOrder::Name});
    EXPECT_NEAR(files.scans.at(0).X_DS.translation_m.x, x_m, 1e-6) << name;
    EXPECT_EQ(files.scans[0].path, 0u);
  }
  for (const std::string name : {"scan.pcd", "-1.5.pcd", "1.-5.pcd", "1317354879123456789.5.pcd",
                                 "9999999999.pcd", "99999999999999999999.pcd", ".5.pcd"}) {
    EXPECT_THAT(
        refusal({.inputs = {write(folder / name, "")}, .poses = poses, .order = PoseOrder::Name}),
        AllOf(HasSubstr(name), HasSubstr("must be its stamp")));
  }
  EXPECT_THAT(refusal({.inputs = {write(folder / "1317354881.pcd", "")},
                       .poses = poses,
                       .order = PoseOrder::Name}),
              HasSubstr("is outside the poses"));
}

// At the magnitude of UTM coordinates, single precision does not resolve millimetres.
TEST(ScanFiles, ShiftsFarPosesByWholeMetres) {
  const TemporaryFolder folder;
  const auto a = write(folder / "a.pcd", ""), b = write(folder / "b.pcd", "");
  const auto poses =
      write(folder / "p.tum",
            "0 400000.25 5000000.75 100.125 0 0 0 1\n1 400010.25 5000000.75 100 0 0 0 1\n");
  const ScanFiles files = find_scans({.inputs = {a, b}, .poses = poses});
  EXPECT_EQ(files.georeference.origin_w_m, glm::dvec3(400000, 5000001, 100));
  EXPECT_EQ(files.scans[0].X_DS.translation_m, glm::dvec3(0.25, -0.25, 0.125));
  EXPECT_EQ(files.scans[1].X_DS.translation_m, glm::dvec3(10.25, -0.25, 0));
  EXPECT_EQ(files.paths.at(0).samples()[1].pose.translation_m, glm::dvec3(10.25, -0.25, 0));
}

}  // namespace
}  // namespace groundray::scan_files_test
