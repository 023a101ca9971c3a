#include "apps/scan/cloud_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <glm/geometric.hpp>

#include "apps/scan/scan.h"
#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::cloud_file_test {
namespace {

using namespace std::string_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

template <typename F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "no Error was thrown";
}

std::filesystem::path corpus(const std::string& name) {
  return testing::data_folder().parent_path() / "test/fuzz/corpus" / name;
}

std::vector<std::string> names_of(const CloudFile& file) {
  std::vector<std::string> names;
  for (const auto& column : file.cloud.columns()) names.push_back(column.name);
  return names;
}

std::string floats(std::initializer_list<float> values) {
  std::string bytes;
  for (const float value : values) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return bytes;
}

TEST(CloudFile, ReadsPlyAndPcd) {
  const CloudFile ply = parse_cloud(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float X\nproperty float Y\n"
      "property float Z\nend_header\n1 2 3\n",
      "a.PLY", {});
  EXPECT_THAT(names_of(ply), ElementsAre("X", "Y", "Z"));
  const CloudFile pcd = read_cloud(corpus("pcd/compressed.pcd"), {});
  EXPECT_THAT(names_of(pcd), ElementsAre("x", "y", "z", "ring", "intensity"));
  EXPECT_EQ(pcd.X_FS, Pose());
}

TEST(CloudFile, ReadsKittiFiles) {
  const std::string bytes = floats({1, 2, 3, 0.5, 4, 5, 6, 0.25});
  const CloudFile file = parse_cloud(bytes, "000000.bin", {});
  EXPECT_THAT(names_of(file), ElementsAre("x", "y", "z", "intensity"));
  EXPECT_EQ(file.cloud.rows(), 2u);
  EXPECT_EQ(file.cloud.column<float>("intensity")[1], 0.25f);
  const CloudFile named = parse_cloud(bytes, "a.bin", {"z", ""});
  EXPECT_THAT(names_of(named), ElementsAre("z"));
  EXPECT_EQ(named.cloud.column<float>("z")[1], 3);
  EXPECT_THAT(message_of([&] { parse_cloud(bytes + "abc", "a.bin", {}); }),
              AllOf(StartsWith("a.bin: its 35 bytes are not a multiple of 16"),
                    HasSubstr("4 floats (x, y, z, intensity)")));
}

TEST(CloudFile, NamesTheColumnsOfNumpyArrays) {
  const auto header = [](int columns) {
    std::string text = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, ";
    text += std::to_string(columns) + ")}";
    text.resize(64, ' ');
    return "\x93NUMPY\x01\x00\x40\x00"s + text;
  };
  EXPECT_THAT(names_of(parse_cloud(header(3) + floats({1, 2, 3}), "a.npy", {})),
              ElementsAre("x", "y", "z"));
  EXPECT_THAT(names_of(parse_cloud(header(5) + floats({1, 2, 3, 4, 5}), "a.npy", {})),
              ElementsAre("x", "y", "z", "intensity", "number 5"));
  EXPECT_THAT(names_of(parse_cloud(header(5) + floats({1, 2, 3, 4, 5}), "a.npy",
                                   {"x", "y", "z", "", "ring"})),
              ElementsAre("x", "y", "z", "ring"));
  EXPECT_THAT(message_of([&] {
                parse_cloud(header(2) + floats({1, 2}), "a.npy", {});
              }),
              HasSubstr("a.npy: its points have 2 numbers; at least x, y and z"));
  EXPECT_THAT(message_of([&] {
                parse_cloud(header(3) + floats({1, 2, 3}), "a.npy", {"x"});
              }),
              HasSubstr("its points have 3 numbers; 1 columns are named: x"));
}

TEST(CloudFile, JoinsTheArraysOfAnArchive) {
  const CloudFile joined = read_cloud(corpus("npy/stored.npz"), {});
  EXPECT_THAT(names_of(joined), ElementsAre("x", "y", "z", "ring"));
  EXPECT_THAT(joined.unread, ElementsAre("scale (of 1 rows)", "names (it contains no numbers)"));
  const CloudFile apart = read_cloud(corpus("npy/deflated.npz"), {});
  EXPECT_THAT(names_of(apart), ElementsAre("x", "y", "z"));
  EXPECT_EQ(apart.cloud.rows(), 100u);
  const CloudFile records = read_cloud(corpus("npy/structured.npy"), {});
  EXPECT_THAT(names_of(records), ElementsAre("x", "y", "t", "n_0", "n_1", "h", "b"));
  EXPECT_THAT(records.unread, ElementsAre("name (no numbers)"));
  ASSERT_EQ(records.origins.size(), 1u);
  EXPECT_EQ(records.origins[0].column, "t");
}

TEST(CloudFile, SuggestsConversionOfOtherFormats) {
  const auto fault_of = [](const char* name) {
    return message_of([name] { read_cloud(name, {}); });
  };
  EXPECT_THAT(fault_of("/no/a.las"), HasSubstr("/no/a.las: there is no such file"));
  for (const char* name : {"a.las", "a.LAZ", "a.mcap"}) {
    EXPECT_THAT(message_of([name] { parse_cloud("garbage", name, {}); }),
                HasSubstr("can only be read from a file, not from memory"));
  }
  EXPECT_THAT(fault_of("a.e57"), HasSubstr("a.e57: E57 is not read: save it as PLY"));
  EXPECT_THAT(fault_of("a.pcap"), HasSubstr("packets are not read"));
  EXPECT_THAT(fault_of("a.xyz"),
              HasSubstr("the extension \".xyz\" is not one of the supported point files"));
  EXPECT_THAT(fault_of("/no/a.ply"), HasSubstr("/no/a.ply: there is no such file"));
}

TEST(CloudFile, RejectsGarbageInEveryFormat) {
  for (const char* name : {"a.ply", "a.pcd", "a.npy", "a.npz", "a.bin"}) {
    EXPECT_THAT(message_of([name] { parse_cloud("garbage", name, {}); }), StartsWith("a."));
  }
}

// A scan of a VLP-16, decoded by the Nebula driver. The driver's own distance column equals the
// distance of the point.
TEST(CloudFile, ReadsAScanOfARealSensor) {
  const auto path =
      testing::shared_data_folder() / "lidar/nebula_velodyne_hesai/vlp16_1673400472138016708.pcd";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const Scan scan = read_scan(path, {.time_unit_s = 1e-9});
  EXPECT_EQ(scan.rows, 14831u);
  ASSERT_NE(scan.find(Quantity::Ring), nullptr);
  ASSERT_NE(scan.find(Quantity::Time), nullptr);
  const auto* const ranges = scan.find(Quantity::Range);
  ASSERT_NE(ranges, nullptr);
  for (std::size_t i = 0; i < scan.p_S.size(); ++i) {
    // Single precision at up to 130 m.
    EXPECT_NEAR((*ranges)[i], glm::length(scan.p_S[i]), 2e-5) << i;
  }
}

}  // namespace
}  // namespace groundray::cloud_file_test
