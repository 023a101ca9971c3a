#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/write/verify.h"

namespace groundray::expected_files_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Optional;

const DatasetSummary dataset{
    .version = {},
    .part = {},
    .sensors = {{.name = "top", .kind = "lidar", .model = {}, .frames = 2'000'000},
                {.name = "eye", .kind = "camera", .model = {}, .frames = 10}}};

FrameEntry frame(const std::string& sensor, std::int64_t number,
                 const std::vector<std::string>& suffixes) {
  FrameEntry entry{.sensor = sensor, .frame = number, .is_done = true, .convergence = {}};
  for (const std::string& suffix : suffixes) entry.files.push_back({suffix, {}});
  return entry;
}

TEST(ExpectedFiles, AreThoseOfFinishedFrames) {
  ExpectedFiles files(dataset);
  for (const std::int64_t number : {0, 1, 2, 5, 1'000'000})
    EXPECT_TRUE(files.add(frame("top", number, {".ply", "_preview.png"})));
  EXPECT_TRUE(files.add(frame("eye", 3, {".exr"})));
  EXPECT_TRUE(files.add(frame("eye", 4, {".exr", ".flo"})));
  files.add(NamedSum{"poses/top.tum", {}});
  for (const char* const path :
       {"dataset.yaml", "poses/top.tum", "lidar/top/000000.ply", "lidar/top/000002_preview.png",
        "lidar/top/000005.ply", "lidar/top/1000000.ply", "camera/eye/000003.exr",
        "camera/eye/000004.flo"})
    EXPECT_EQ(files.fault_of(path), std::nullopt) << path;
  for (const char* const path :
       {"lidar/top/000003.ply", "lidar/top/000004.ply", "lidar/top/000006.ply",
        "lidar/top/1000001.ply", "camera/eye/000002.exr", "camera/eye/000009.x"})
    EXPECT_THAT(files.fault_of(path), Optional(HasSubstr("of an unfinished frame"))) << path;
  for (const char* const path :
       {"", "/", "x", "poses/eye.tum", "poses", "lidar/top/0.ply", "lidar/top/0000000.ply",
        "lidar/top/000000.plx", "lidar/top/000000", "lidar/top/.ply", "lidar/eye/000003.exr",
        "camera/eye/000003.flo", "camera/eye/000010.exr", "lidar/top/000000.ply.part",
        "lidar/top/2000000.ply", "lidar/top/99999999999999999999.ply", "a/lidar/top/000000.ply"})
    EXPECT_EQ(files.fault_of(path), "not a file of the dataset") << path;
}

TEST(ExpectedFiles, AcceptFramesInOrderOnly) {
  ExpectedFiles files(dataset);
  EXPECT_TRUE(files.add(frame("eye", 4, {".exr"})));
  EXPECT_FALSE(files.add(frame("eye", 4, {".exr"})));
  EXPECT_FALSE(files.add(frame("eye", 1, {".exr"})));
  EXPECT_FALSE(files.add(frame("eye", 10, {".exr"})));
  EXPECT_FALSE(files.add(frame("ear", 5, {".exr"})));
}

TEST(ExpectedFiles, IncludeFoldersOfSensorsAndOfOtherFiles) {
  ExpectedFiles files(dataset);
  files.add(NamedSum{"poses/top.tum", {}});
  for (const char* const path : {"lidar", "lidar/top", "camera", "camera/eye", "poses"})
    EXPECT_TRUE(files.has_folder(path)) << path;
  for (const char* const path : {"", "lidar/eye", "calibration", "poses/top.tum"})
    EXPECT_FALSE(files.has_folder(path)) << path;
}

}  // namespace
}  // namespace groundray::expected_files_test
