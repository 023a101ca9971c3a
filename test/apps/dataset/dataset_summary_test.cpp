#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/dataset_reader.h"
#include "apps/dataset/dataset_text.h"
#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::dataset_summary_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Reads a dataset with these sensors and no listed frames.
DatasetSummary read(const std::vector<std::string>& sensors,
                    const std::optional<Shard>& shard = std::nullopt) {
  const testing::TemporaryFolder folder;
  std::string header = "groundray_dataset: 1\nversion: \"1\"\nseed: 7\nsensors:\n";
  for (const std::string& sensor : sensors) header += "  - {" + sensor + "}\n";
  write_dataset_text(folder.path(), header, {shard, {}}, [] { return std::nullopt; }, {});
  return read_summary(folder.path());
}

TEST(DatasetSummary, ListsSensorsButNotStereoPairs) {
  const DatasetSummary dataset =
      read({"name: top-1, kind: lidar, frames: 3", "name: eye_L, kind: camera, frames: 2",
            "name: pair, kind: stereo, left: eye_L, right: eye_L"});
  ASSERT_EQ(dataset.sensors.size(), 2u);
  EXPECT_EQ(dataset.asked_for, 5u);
  EXPECT_EQ(dataset.stem_of({.sensor = "eye_L", .frame = 1}), "camera/eye_L/000001");
}

// Names become parts of paths to which files are written, so no name may lead out of the dataset.
TEST(DatasetSummary, RejectsNamesThatLeaveTheDataset) {
  for (const std::string name : {"../x", "/tmp/x", "a/b", ".", "..", "a b", "\"\\0\"", "\u00e4"}) {
    EXPECT_THAT([&] { read({"name: " + name + ", kind: lidar, frames: 1"}); },
                ThrowsMessage<Error>(AllOf(HasSubstr("dataset.yaml:5"), HasSubstr("name"))))
        << name;
    EXPECT_THAT([&] { read({"name: a, kind: " + name + ", frames: 1"}); },
                ThrowsMessage<Error>(AllOf(HasSubstr("dataset.yaml:5"), HasSubstr("kind"))))
        << name;
  }
  EXPECT_THROW(read({"name: \"\", kind: lidar, frames: 1"}), Error);
  EXPECT_THAT(
      [] {
        read({"name: a, kind: lidar, frames: 1", "name: a, kind: camera, frames: 1"});
      },
      ThrowsMessage<Error>(HasSubstr("'a' is taken by an earlier sensor")));
}

// Counting takes no time or memory per frame.
TEST(DatasetSummary, CountsFramesInConstantTime) {
  const std::string most = "name: a, kind: lidar, frames: 4294967295";
  EXPECT_EQ(read({most}).asked_for, 4294967295u);
  std::size_t of_shards = 0;
  for (const std::uint32_t index : {1u, 2u, 3u, 4u})
    of_shards += read({most}, Shard{index, 4}).asked_for;
  EXPECT_EQ(of_shards, 4294967295u);
}

}  // namespace
}  // namespace groundray::dataset_summary_test
