#include "apps/scan/cloud_blocks.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::cloud_blocks_test {
namespace {

using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

constexpr int points = 1003;

std::string rows() {
  std::string bytes(std::size_t{points} * 4 * sizeof(float), '\0');
  for (int i = 0; i < points * 4; ++i) {
    const float value = 0.25f * static_cast<float>(i) + 1;
    std::memcpy(bytes.data() + static_cast<std::size_t>(i) * sizeof value, &value, sizeof value);
  }
  return bytes;
}

std::string npy(const std::string& order) {
  std::string text =
      "{'descr': '<f4', 'fortran_order': " + order + fmt::format(", 'shape': ({}, 4), }}", points);
  text.resize(117, ' ');
  text += '\n';
  std::string head = "\x93NUMPY";
  head += std::string("\x01\x00", 2);
  head += static_cast<char>(text.size());
  head += '\0';
  return head + text + rows();
}

std::string ply(const std::string& format, const std::string& more) {
  return fmt::format(
             "ply\nformat {} 1.0\ncomment of a test\nelement vertex {}\nproperty float x\n"
             "property float y\nproperty float32 z\nproperty float intensity\n{}end_header\n",
             format, points, more) +
         rows();
}

std::string pcd(const std::string& data) {
  return fmt::format(
             "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n"
             "COUNT 1 1 1 1\nWIDTH {}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {}\n",
             points, points, data) +
         rows();
}

std::vector<float> column(const CloudFile& file, std::size_t i) {
  return std::vector<float>(std::get<0>(file.cloud.columns()[i].values).begin(),
                            std::get<0>(file.cloud.columns()[i].values).end());
}

// Blocks of any size give all rows once, in order, as the reader of whole files does.
TEST(CloudBlocks, TogetherEqualTheFile) {
  const TemporaryFolder folder;
  const std::string face = "element face 0\nproperty list uchar int vertex_indices\n";
  const std::vector<std::pair<std::string, std::string>> files{
      {"a.bin", rows()},
      {"a.npy", npy("False")},
      {"a.ply", ply("binary_little_endian", "")},
      {"b.ply", ply("binary_little_endian", face)},
      {"a.pcd", pcd("binary")}};
  for (const auto& [name, bytes] : files) {
    write_text(folder / name, bytes);
    const CloudFile whole = read_cloud(folder / name, {});
    for (const std::size_t block_bytes : {1UL, 16UL * 100, 16UL * points, 1UL << 20U}) {
      auto blocks = CloudBlocks::open(folder / name, {}, block_bytes);
      ASSERT_TRUE(blocks) << name;
      std::vector<std::vector<float>> all(4);
      while (const auto block = blocks->next()) {
        ASSERT_EQ(block->cloud.columns().size(), 4U) << name;
        for (std::size_t i = 0; i < all.size(); ++i) {
          EXPECT_EQ(block->cloud.columns()[i].name, whole.cloud.columns()[i].name);
          const auto more = column(*block, i);
          all[i].insert(all[i].end(), more.begin(), more.end());
        }
      }
      EXPECT_EQ(blocks->rows_read(), static_cast<std::uint64_t>(points));
      for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i], column(whole, i)) << name;
    }
  }
}

// Text files, columns stored one after the other, lists, and truncated files are left to the reader
// of whole files.
TEST(CloudBlocks, RejectsLayoutsThatCannotBeSplit) {
  const TemporaryFolder folder;
  const std::string list = "property list uchar int of\n";
  const std::string whole = ply("binary_little_endian", "");
  const std::vector<std::pair<std::string, std::string>> files{
      {"a.npy", npy("True")},
      {"b.npy", "no array"},
      {"a.ply", ply("ascii", "")},
      {"b.ply", ply("binary_little_endian", list)},
      {"c.ply", whole.substr(0, whole.size() - 1)},
      {"d.ply", "ply\n"},
      {"a.pcd", pcd("binary_compressed")},
      {"a.bin", rows() + "?"},
      {"a.npz", "PK"}};
  for (const auto& [name, bytes] : files) {
    write_text(folder / name, bytes);
    EXPECT_FALSE(CloudBlocks::open(folder / name, {}, 1000)) << name;
  }
  EXPECT_FALSE(CloudBlocks::open(folder / "none.npy", {}, 1000));
}

}  // namespace
}  // namespace groundray::cloud_blocks_test
