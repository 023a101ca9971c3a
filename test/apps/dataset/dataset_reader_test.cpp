#include "apps/dataset/dataset_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/dataset/dataset_text.h"
#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::dataset_reader_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

constexpr const char* yaml =
    "groundray_dataset: 1\n"
    "origin_w_m: [400000, 5000000, 100]\n"
    "crs: EPSG:32632\n"
    "sensors:\n"
    "  - {name: top, kind: lidar}\n"
    "  - {name: rear, kind: lidar}\n"
    "  - {name: eye, kind: camera}\n"
    "frames:\n"
    "  - {sensor: top, frame: 1, stamp_s: 0.1, state: done}\n"
    "  - {sensor: top, frame: 0, stamp_s: 0, state: done}\n"
    "  - {sensor: eye, frame: 0, stamp_s: 0, state: done}\n"
    "  - {sensor: top, frame: 2, stamp_s: 0.2, state: pending}\n"
    "  - {sensor: rear, frame: 7, stamp_s: 0.000000001, state: done}\n";

void write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

// Writes a dataset with two lidars and a camera.
void write_dataset(const TemporaryFolder& folder, const std::string& text) {
  write(folder / "dataset.yaml", text);
  for (const std::string name : {"top", "rear"})
    write(folder / "poses" / (name + ".tum"), "0 1 2 3 0 0 0 1\n0.5 2 2 3 0 0 0 1\n");
  write(folder / "calibration/top.yaml", "range_noise_sigma_m: 0.02\npoints: at_stamp\nmore: 7\n");
  write(folder / "calibration/rear.yaml", "range_noise_sigma_m: 0\n");
}

std::string refusal(const std::filesystem::path& folder) {
  try {
    read_dataset(folder);
  } catch (const Error& fault) {
    return fault.what();
  }
  return "";
}

TEST(DatasetReader, ReadsFinishedFramesOfEachLidar) {
  const TemporaryFolder folder;
  write_dataset(folder, yaml);
  const RecordedDataset dataset = read_dataset(folder.path());
  EXPECT_EQ(dataset.georeference.origin_w_m, glm::dvec3(400000, 5000000, 100));
  EXPECT_EQ(dataset.georeference.crs_name, "EPSG:32632");
  ASSERT_EQ(dataset.lidars.size(), 2u);
  const RecordedLidar &top = dataset.lidars[0], &rear = dataset.lidars[1];
  EXPECT_EQ(top.name, "top");
  EXPECT_EQ(top.points, LidarSpec::Points::AtStamp);
  EXPECT_EQ(top.range_noise_sigma_m, 0.02);
  EXPECT_EQ(top.pending, 1u);
  ASSERT_EQ(top.frames.size(), 2u) << "in order, and none that is not there yet";
  EXPECT_EQ(top.frames[0].number, 0);
  EXPECT_EQ(top.frames[1].stamp, std::chrono::milliseconds(100));
  EXPECT_EQ(top.frames[1].file, folder / "lidar/top/000001.ply");
  EXPECT_EQ(rear.points, LidarSpec::Points::AsFired);
  ASSERT_EQ(rear.frames.size(), 1u);
  EXPECT_EQ(rear.frames[0].stamp, std::chrono::nanoseconds(1));
  EXPECT_EQ(rear.X_DS.samples().size(), 2u);
}

std::string changed(const std::string& from, const std::string& to) {
  std::string text = yaml;
  text.replace(text.find(from), from.size(), to);
  return text;
}

// The generator writes the entries one by one, and the reader reads the file line by line, because
// it may be larger than any other file of the dataset.
TEST(DatasetReader, ReadsAnyNumberOfFrames) {
  constexpr std::int64_t frames = 100'000;
  const TemporaryFolder folder;
  write_dataset(folder, "");
  const FileSum sum{1 << 20, sha256_of("")};
  std::int64_t next = 0;
  write_dataset_text(folder.path(),
                     "groundray_dataset: 1\norigin_w_m: [4, 5, 6]\nsensors:\n"
                     "  - {name: top, kind: lidar, frames: 100000}\n",
                     {.shard = Shard{1, 2}, .choice = {}},
                     [&]() -> std::optional<std::string> {
                       if (next == frames) return std::nullopt;
                       FrameEntry entry{"top",         next, std::chrono::milliseconds(100 * next),
                                        next % 10 > 0, {},   {}};
                       if (entry.is_done) entry.files = {{"_preview.png", sum}, {".ply", sum}};
                       ++next;
                       return text_of(entry);
                     },
                     {});
  EXPECT_GT(std::filesystem::file_size(folder / "dataset.yaml"), std::uintmax_t{16} << 20);
  const RecordedDataset dataset = read_dataset(folder.path());
  ASSERT_EQ(dataset.lidars.size(), 1u);
  const RecordedLidar& top = dataset.lidars[0];
  EXPECT_EQ(top.pending, 10'000u);
  ASSERT_EQ(top.frames.size(), 90'000u);
  EXPECT_EQ(top.frames.back().number, frames - 1);
  EXPECT_EQ(top.frames.back().stamp, std::chrono::milliseconds(100 * (frames - 1)));
  EXPECT_EQ(top.frames[0].file, folder / "lidar/top/000001.ply");
  EXPECT_EQ(dataset.georeference.origin_w_m, glm::dvec3(4, 5, 6));
}

TEST(DatasetReader, ErrorsNameFileLineAndRule) {
  const std::vector<std::pair<std::string, std::string>> bad{
      {changed("dataset: 1", "dataset: 2"), "reads only format 1"},
      {changed("state: done", "state: gone"), "dataset.yaml:9:"},
      {changed("stamp_s: 0.1", "stamp_s: 1e300"), "must be within 9e9 s"},
      {changed("stamp_s: 0.1", "stamp_s: nan"), "stamp_s"},
      {changed("frame: 1", "frame: -1"), "frame"},
      {changed("[400000, 5000000, 100]", "[4, 5]"), "origin_w_m"},
      {changed("name: top, ", ""), "dataset.yaml:5:5: key 'name': missing"},
      {changed("origin_w_m", "origin"), "key 'origin_w_m': missing"},
      {changed("{sensor: top, frame: 1, ", "{frame: 1, "),
       "dataset.yaml:9:5: key 'sensor': missing"},
      {changed(", state: pending", ""), "key 'state': missing"},
      {changed("kind: camera}", "kind: camera, frames: 3}"),
       "dataset.yaml:7:39: key 'frames': eye has 3 frames, but 1 are listed: was the file "
       "truncated?"},
      {changed("sensors:", "sensors: 3 #"), "dataset.yaml"},
      {"", "dataset.yaml"},
      {"[", "dataset.yaml"}};
  for (const auto& [text, rule] : bad) {
    const TemporaryFolder folder;
    write_dataset(folder, text);
    EXPECT_THAT(refusal(folder.path()), AllOf(HasSubstr("dataset.yaml"), HasSubstr(rule))) << text;
  }
  const TemporaryFolder folder;
  write_dataset(folder, yaml);
  write(folder / "calibration/rear.yaml", "range_noise_sigma_m: -1\n");
  EXPECT_THAT(refusal(folder.path()), AllOf(HasSubstr("rear.yaml:1"), HasSubstr("must be >= 0")));
  write(folder / "calibration/rear.yaml", "points: as_fired\n");
  EXPECT_THAT(refusal(folder.path()), HasSubstr("key 'range_noise_sigma_m': missing"));
  std::filesystem::remove(folder / "poses/top.tum");
  EXPECT_THAT(refusal(folder.path()), HasSubstr("top.tum"));
}

}  // namespace
}  // namespace groundray::dataset_reader_test
