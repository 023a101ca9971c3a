#include "reconstruction/mesh/scan/range_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>

#include "core/error.h"
#include "test/support/gzip_file.h"
#include "test/support/temporary_folder.h"

namespace groundray::range_grid_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

// 2 rows of 3 cells; the second and the fourth have no return.
constexpr std::string_view info = "obj_info is_mesh 0\nobj_info num_cols 3\nobj_info num_rows 2\n";
constexpr std::string_view elements =
    "element vertex 4\nproperty float x\nproperty float y\nproperty double z\nproperty uchar "
    "intensity\nelement range_grid 6\nproperty list uchar int vertex_indices\nend_header\n";
constexpr std::string_view ascii_rows =
    "0 0 0.5 7\n2 0 1.5 7\n1 1 2.5 7\n2 1 3.5 7\n1 0\n0\n1 1\n0\n1 2\n1 3\n";

std::string ascii(std::string_view infos = info, std::string_view rows = ascii_rows) {
  return "ply\nformat ascii 1.0\n" + std::string(infos) + std::string(elements) + std::string(rows);
}

template <typename T>
void put(std::string& bytes, T value, bool is_big) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (is_big) std::ranges::reverse(raw);
  bytes.append(raw.data(), raw.size());
}

std::string binary(bool is_big) {
  std::string bytes = std::string("ply\nformat ") +
                      (is_big ? "binary_big_endian" : "binary_little_endian") + " 1.0\n" +
                      std::string(info) + std::string(elements);
  for (const auto& [x, y, z] : {std::array{0.f, 0.f, .5f}, std::array{2.f, 0.f, 1.5f},
                                std::array{1.f, 1.f, 2.5f}, std::array{2.f, 1.f, 3.5f}}) {
    put(bytes, x, is_big);
    put(bytes, y, is_big);
    put(bytes, double{z}, is_big);
    put(bytes, std::uint8_t{7}, is_big);
  }
  for (const int vertex : {0, -1, 1, -1, 2, 3}) {
    put(bytes, static_cast<std::uint8_t>(vertex >= 0), is_big);
    if (vertex >= 0) put(bytes, std::int32_t{vertex}, is_big);
  }
  return bytes;
}

TEST(RangeGrid, ReadsCellsAsStored) {
  TemporaryFolder folder;
  std::ofstream(folder / "grid.ply", std::ios::binary) << ascii();
  const RangeGridBeams beams{.back_m = {0, 0, 10}, .sd_m = 0.25f};
  for (const OrganisedScan& scan :
       {parse_range_grid(ascii(), "a", beams), parse_range_grid(binary(false), "b", beams),
        parse_range_grid(binary(true), "c", beams), read_range_grid(folder / "grid.ply", beams)}) {
    EXPECT_EQ(scan.rows, 2);
    EXPECT_EQ(scan.columns, 3);
    EXPECT_FALSE(scan.is_round);
    const std::uint32_t none = OrganisedScan::none;
    EXPECT_EQ(scan.returns, (std::vector<std::uint32_t>{0, none, 1, none, 2, 3}));
    EXPECT_EQ(scan.sd_m, std::vector<float>(6, 0.25f));
    EXPECT_EQ(scan.points_m[2], glm::dvec3(2, 0, 1.5));
    EXPECT_EQ(scan.origins_m[2], glm::dvec3(2, 0, 11.5));
    EXPECT_EQ(scan.points_m[5], glm::dvec3(2, 1, 3.5));
    EXPECT_TRUE(std::isnan(scan.points_m[1].x) && std::isnan(scan.origins_m[3].z));
  }
}

std::string fault_of(const std::string& bytes) {
  try {
    parse_range_grid(bytes, "scan.ply", {});
  } catch (const Error& fault) {
    return fault.what();
  }
  return "";
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(RangeGrid, ErrorsNameTheFileAndTheRule) {
  EXPECT_THAT(fault_of(ascii("")), AllOf(HasSubstr("scan.ply: "), HasSubstr("'obj_info num_rows")));
  EXPECT_THAT(fault_of(ascii("obj_info num_rows 2\n")), HasSubstr("'obj_info num_cols"));
  EXPECT_THAT(fault_of(replaced(ascii(), "num_cols 3", "num_cols -3")),
              HasSubstr("\"-3\" must be"));
  EXPECT_THAT(fault_of(replaced(ascii(), "num_cols 3", "num_cols 4")),
              HasSubstr("range_grid has 6 rows, but num_rows x num_cols = 2 x 4 = 8"));
  EXPECT_THAT(fault_of(replaced(ascii(), "1 2\n", "1 4\n")),
              HasSubstr("refers to vertex 4, but there are 4 vertices"));
  EXPECT_THAT(fault_of(replaced(ascii(), "1 2\n", "1 -1\n")), HasSubstr("refers to vertex -1"));
  EXPECT_THAT(fault_of(replaced(ascii(), "1 2\n", "1 .5\n")), HasSubstr("vertex 0.5"));
  EXPECT_THAT(fault_of(replaced(ascii(), "1 2\n", "2 2 1\n")), HasSubstr("refers to 2 vertices"));
  EXPECT_THAT(fault_of(replaced(ascii(), "1 2\n", ".5 2\n")), HasSubstr("a list of 0.5 numbers"));
  EXPECT_THAT(fault_of(replaced(ascii(), "1 3\n", "")), HasSubstr("truncated"));
  EXPECT_THAT(fault_of(replaced(ascii(), "property double z", "property double w")),
              HasSubstr("must have x, y and z"));
  EXPECT_THAT(fault_of(replaced(ascii(), "element range_grid 6", "element face 6")),
              HasSubstr("no element range_grid"));
  EXPECT_THAT(fault_of(replaced(ascii(), "list uchar int vertex_indices", "int vertex_indices")),
              HasSubstr("must have a list vertex_indices"));
  const std::string whole = binary(false);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_NE(fault_of(whole.substr(0, size)), "") << size;
  EXPECT_EQ(fault_of(whole), "");
}

// Expected counts from the files themselves: 512 x 400 cells, one for each vertex.
TEST(RangeGrid, ReadsStanfordScans) {
  const auto folder = shared_data_folder() / "mesh/stanford_bunny_scans";
  if (!std::filesystem::exists(folder))
    GTEST_SKIP() << "there are no range scans in " << folder << "; set GROUNDRAY_SHARED_DATA";
  for (const auto& [name, vertices] : {std::pair("bun000", 40256), {"top2", 38298}}) {
    const OrganisedScan scan =
        parse_range_grid(read_gzip(folder / (std::string(name) + ".ply.gz")), name, {});
    EXPECT_EQ(scan.rows, 400);
    EXPECT_EQ(scan.columns, 512);
    EXPECT_EQ(std::ranges::count_if(scan.points_m, [](auto& p) { return std::isfinite(p.x); }),
              vertices);
  }
}

}  // namespace
}  // namespace groundray::range_grid_test
