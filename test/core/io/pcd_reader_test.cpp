#include "core/io/pcd_reader.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <random>

#include "core/error.h"
#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::pcd_reader_test {
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

std::string fault_in(const std::string& bytes) {
  return message_of([&] { parse_pcd(bytes, "a.pcd"); });
}

template <typename T>
std::vector<T> values_of(const PointCloud& cloud, const std::string& name) {
  const auto column = cloud.column<T>(name);
  return {column.begin(), column.end()};
}

template <typename... T>
std::string bytes_of(T... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
  return bytes;
}

/// A header of `points` points of x (float), t (64-bit integer), and two numbers n (16 bits).
std::string header(std::size_t points, const std::string& data) {
  return fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x _ t n\nSIZE 4 1 8 2\n"
      "TYPE F U U I\nCOUNT 1 3 1 2\nWIDTH {0}\nHEIGHT 1\nVIEWPOINT 1 2 3 0 0 0 1\nPOINTS {0}\n"
      "DATA {1}\n",
      points, data);
}

constexpr std::uint64_t stamp = 1'673'400'471'837'873'222;

void expect_two_points(const PcdFile& file) {
  EXPECT_EQ(file.cloud.columns().size(), 4u);  // without padding
  EXPECT_THAT(values_of<float>(file.cloud, "x"), ElementsAre(1.5f, -0.25f));
  EXPECT_THAT(values_of<double>(file.cloud, "t"), ElementsAre(7, 0));
  ASSERT_EQ(file.origins.size(), 1u);
  EXPECT_EQ(file.origins[0].column, "t");
  EXPECT_EQ(file.origins[0].origin, static_cast<std::int64_t>(stamp));
  EXPECT_THAT(values_of<std::int16_t>(file.cloud, "n_0"), ElementsAre(-1, 300));
  EXPECT_THAT(values_of<std::int16_t>(file.cloud, "n_1"), ElementsAre(2, -300));
  EXPECT_EQ(file.X_FS.translation_m, glm::dvec3(1, 2, 3));
  EXPECT_EQ(file.X_FS.rotation, glm::dquat(0, 0, 0, 1));  // qw comes first
}

TEST(ReadPcd, ReadsHandmadeText) {
  for (const char* end : {"\n", "\r\n", ""}) {
    expect_two_points(parse_pcd(header(2, "ascii") +
                                    "1.5 0 0 0 1673400471837873229 -1 2\n"
                                    "-0.25 9 9 9 1673400471837873222 300 -300" +
                                    end,
                                "a.pcd"));
  }
}

TEST(ReadPcd, ReadsHandmadeBinary) {
  const std::string points =
      bytes_of(1.5f) + "abc" + bytes_of(stamp + 7, std::int16_t{-1}, std::int16_t{2}) +
      bytes_of(-0.25f) + "abc" + bytes_of(stamp, std::int16_t{300}, std::int16_t{-300});
  expect_two_points(parse_pcd(header(2, "binary") + points, "a.pcd"));
  expect_two_points(parse_pcd(header(2, "binary") + points + "\0\0\0"s, "a.pcd"));
}

// Field by field, and all as literal runs of LZF, without compression.
TEST(ReadPcd, ReadsHandmadeCompressedPoints) {
  const std::string points =
      bytes_of(1.5f, -0.25f) + "abcabc" + bytes_of(stamp + 7, stamp) +
      bytes_of(std::int16_t{-1}, std::int16_t{2}, std::int16_t{300}, std::int16_t{-300});
  ASSERT_EQ(points.size(), 38u);
  const std::string packed = "\x1f"s + points.substr(0, 32) + "\x05"s + points.substr(32);
  const auto sizes = bytes_of(static_cast<std::uint32_t>(packed.size()), std::uint32_t{38});
  const std::string file = header(2, "binary_compressed") + sizes + packed;
  expect_two_points(parse_pcd(file, "a.pcd"));
  expect_two_points(parse_pcd(file + std::string(100, '\0'), "a.pcd"));  // padding as PCL leaves it
  EXPECT_THAT(fault_in(file + "x"), HasSubstr("1 bytes follow the last point"));
  EXPECT_THAT(fault_in(file.substr(0, file.size() - 1)), HasSubstr("is it truncated?"));
}

// LibLZF's format: control 2 is a literal run of three bytes; 0x20 + 0x00 copies three bytes from
// one byte back, 0xe0 + n more.
TEST(Lzf, UnpacksRunsAndOverlappingCopies) {
  EXPECT_EQ(unpack_lzf("\x02"s + "abc", 3), "abc");
  EXPECT_EQ(unpack_lzf("\x02"s + "abc" + "\x20\x02"s, 6), "abcabc");
  EXPECT_EQ(unpack_lzf("\x00"s + "a" + "\x20\x00"s, 4), "aaaa");
  EXPECT_EQ(unpack_lzf("\x00"s + "a" + "\xe0\x05\x00"s, 15), std::string(15, 'a'));
  EXPECT_EQ(unpack_lzf("", 0), "");
}

TEST(Lzf, RejectsDamagedData) {
  EXPECT_THROW(unpack_lzf("\x02"s + "ab", 3), Error);  // a run that ends early
  EXPECT_THROW(unpack_lzf("\x00"s + "a" + "\x20\x01"s, 4),
               Error);                                          // refers to before the first byte
  EXPECT_THROW(unpack_lzf("\x00"s + "a" + "\x20"s, 4), Error);  // lacks its distance
  EXPECT_THROW(unpack_lzf("\x02"s + "abc", 2), Error);
  EXPECT_THROW(unpack_lzf("\x02"s + "abc", 4), Error);
  EXPECT_THROW(unpack_lzf("\x00"s + "a", std::size_t{1} << 40), Error);  // allocates no memory
}

/// The files in test/fuzz/corpus/pcd were written by Open3D 0.20 from 40 points (i % 4, i / 4 / 2,
/// -1.25), ring i % 4 and intensity i % 7.
TEST(ReadPcd, ReadsFilesWrittenByOpen3d) {
  const auto corpus = testing::data_folder().parent_path() / "test/fuzz/corpus/pcd";
  for (const char* name : {"ascii.pcd", "binary.pcd", "compressed.pcd"}) {
    const PcdFile file = read_pcd(corpus / name);
    ASSERT_EQ(file.cloud.rows(), 40u) << name;
    for (std::size_t i = 0; i < 40; ++i) {
      EXPECT_EQ(file.cloud.column<float>("x")[i], static_cast<float>(i % 4));
      const std::size_t line = i / 4;
      EXPECT_EQ(file.cloud.column<float>("y")[i], 0.5f * static_cast<float>(line));
      EXPECT_EQ(file.cloud.column<float>("z")[i], -1.25f);
      EXPECT_EQ(file.cloud.column<std::uint16_t>("ring")[i], i % 4);
      EXPECT_EQ(file.cloud.column<float>("intensity")[i], static_cast<float>(i % 7));
    }
    EXPECT_EQ(file.X_FS, Pose());
  }
}

// A file of the Point Cloud Library; the expected values are those that Open3D reads from it.
TEST(ReadPcd, ReadsFilesCompressedByPcl) {
  const auto path = testing::shared_data_folder() / "lidar/isprs_filtertest/samp53-utm.pcd";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const PcdFile file = read_pcd(path);
  ASSERT_EQ(file.cloud.rows(), 34378u);
  EXPECT_EQ(file.cloud.column<float>("x")[34377], 0x1.e3814cp+18f);
  EXPECT_EQ(file.cloud.column<float>("y")[34377], 0x1.4ad4dp+22f);
  EXPECT_EQ(file.cloud.column<float>("z")[34377], 0x1.17999ap+8f);
}

TEST(ReadPcd, KeepsTheOrderOfOrganisedClouds) {
  const PcdFile file = parse_pcd(
      "FIELDS x\nSIZE 4\nTYPE F\nWIDTH 2\nHEIGHT 3\nDATA ascii\n1\n2\n3\nnan\ninf\n-inf\n",
      "a.pcd");
  EXPECT_EQ(file.width, 2u);
  EXPECT_EQ(file.height, 3u);
  EXPECT_THAT(values_of<float>(file.cloud, "x"),
              ElementsAre(1, 2, 3, ::testing::IsNan(), std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()));
}

TEST(ReadPcd, DetectsEveryTruncation) {
  const auto corpus = testing::data_folder().parent_path() / "test/fuzz/corpus/pcd";
  for (const char* name : {"ascii.pcd", "binary.pcd", "compressed.pcd"}) {
    const std::string bytes = read_text(corpus / name);
    // Without its last line end, and a last digit or two, a text cannot be distinguished from a
    // complete one.
    const std::size_t least = name == "ascii.pcd"s ? 5 : 1;
    for (std::size_t size = 0; size + least <= bytes.size(); ++size) {
      EXPECT_THROW(parse_pcd(bytes.substr(0, size), "a.pcd"), Error) << name << " " << size;
    }
  }
}

TEST(ReadPcd, ReportsLineAndRuleOfABadHeader) {
  const std::string fields = "FIELDS x y\nSIZE 4 4\nTYPE F F\n";
  const std::tuple<std::string, const char*, const char*> files[] = {
      {"", "a.pcd:0: ", "lacks its last line, DATA"},
      {"ply\n", "a.pcd:1: ", "\"ply\" must be a key of a PCD header"},
      {fields + "WIDTH 1\n", "a.pcd:4: ", "lacks its last line, DATA"},
      {fields + "WIDTH -1\n", "a.pcd:4: ", "\"-1\" must be an integer >= 0"},
      {fields + "WIDTH\n", "a.pcd:4: ", "WIDTH must be followed by one number"},
      {fields + "DATA text\n", "a.pcd:4: ", "DATA must be ascii, binary"},
      {fields + "DATA ascii\n", "a.pcd:4: ", "must have WIDTH or POINTS"},
      {"POINTS 1\nDATA ascii\n", "a.pcd:2: ", "must have FIELDS"},
      {fields + "COUNT 1\nPOINTS 1\nDATA ascii\n", "a.pcd:6: ", "COUNT has 1 values"},
      {fields + "COUNT 1 5000\nPOINTS 1\nDATA ascii\n", "a.pcd:6: ", "more than 4096 numbers"},
      {"FIELDS x\nSIZE 3\nPOINTS 1\nDATA ascii\n",
       "a.pcd:4: ", "TYPE \"F\" of SIZE 3 is not supported"},
      {"FIELDS x x\nPOINTS 1\nDATA ascii\n1 2\n", "a.pcd:4: ", "the column 'x' already exists"},
      {fields + "WIDTH 2\nHEIGHT 2\nPOINTS 3\nDATA ascii\n", "a.pcd:7: ", "WIDTH 2 times HEIGHT 2"},
      {fields + "VIEWPOINT 0 0 0 1 0 0\n", "a.pcd:4: ", "must be tx ty tz qw qx qy qz"},
      {fields + "VIEWPOINT 0 0 0 0 0 0 0\n", "a.pcd:4: ", "has a norm of 0"},
      {fields + "VIEWPOINT 0 0 a 1 0 0 0\n", "a.pcd:4: ", "\"a\" is not a finite number"},
  };
  for (const auto& [bytes, place, rule] : files) {
    EXPECT_THAT(fault_in(bytes), AllOf(StartsWith(place), HasSubstr(rule)));
  }
}

TEST(ReadPcd, ReportsLineAndRuleOfABadRow) {
  const std::string start = "FIELDS x a\nSIZE 4 1\nTYPE F U\nPOINTS 2\nDATA ascii\n";
  EXPECT_THAT(fault_in(start + "1 2\n3 256\n"), StartsWith("a.pcd:7: a = \"256\" is not a number"));
  EXPECT_THAT(fault_in(start + "1 2\n3\n"),
              StartsWith("a.pcd:7: the row has 1 values; a point has 2"));
  EXPECT_THAT(fault_in(start + "1 2     \n"), StartsWith("a.pcd:6: there are 1 points instead"));
  EXPECT_THAT(fault_in(start + "1 2\n3 4\n5 6\n"),
              StartsWith("a.pcd:7: more rows follow the last"));
}

TEST(ReadPcd, RejectsCountsBeyondTheFileSizeBeforeAllocating) {
  for (const char* data : {"ascii", "binary", "binary_compressed"}) {
    for (const char* count : {"1000000000000", "4294967296", "18446744073709551615"}) {
      EXPECT_THAT(fault_in(fmt::format("FIELDS x\nPOINTS {}\nDATA {}\n1 2 3\n", count, data)),
                  StartsWith("a.pcd"))
          << data;
    }
  }
}

TEST(ReadPcd, NamesAMissingFile) {
  EXPECT_THAT(message_of([] { read_pcd("/no/a.pcd"); }),
              HasSubstr("/no/a.pcd: there is no such file"));
}

}  // namespace
}  // namespace groundray::pcd_reader_test
