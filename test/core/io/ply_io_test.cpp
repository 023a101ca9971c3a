#include "core/io/ply_io.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>

#include "core/error.h"
#include "test/support/file_size_limit.h"
#include "test/support/temporary_folder.h"

namespace groundray::ply_io_test {
namespace {

using namespace std::string_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using testing::FileSizeLimit;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using testing::TemporaryFolder;

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

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
  return message_of([&] { parse_ply(bytes, "a.ply"); });
}

/// Columns of every type with every bit pattern, including NaNs.
PointCloud random_cloud(std::size_t rows) {
  PointCloud cloud(rows);
  std::mt19937_64 random(rows);
  const auto fill = [&]<typename T>(const char* name, T) {
    for (T& value : cloud.add<T>(name)) {
      const std::uint64_t bits = random();
      std::memcpy(&value, &bits, sizeof value);
    }
  };
  fill("a", std::uint8_t{});
  fill("x", float{});
  fill("world_x", double{});
  fill("ring", std::uint16_t{});
  fill("instance", std::uint32_t{});
  fill("b", std::int8_t{});
  fill("c", std::int16_t{});
  fill("d", std::int32_t{});
  return cloud;
}

void expect_equal_bits(const PointCloud& actual, const PointCloud& expected) {
  ASSERT_EQ(actual.rows(), expected.rows());
  ASSERT_EQ(actual.columns().size(), expected.columns().size());
  for (std::size_t i = 0; i < actual.columns().size(); ++i) {
    const std::string& name = expected.columns()[i].name;
    EXPECT_EQ(actual.columns()[i].name, name);
    ASSERT_EQ(actual.columns()[i].values.index(), expected.columns()[i].values.index()) << name;
    std::visit(
        [&](const auto& column) {
          const auto& read = std::get<std::decay_t<decltype(column)>>(actual.columns()[i].values);
          ASSERT_EQ(read.size(), column.size());
          if (column.empty()) return;
          EXPECT_EQ(std::memcmp(read.data(), column.data(), column.size() * sizeof column[0]), 0)
              << name;
        },
        expected.columns()[i].values);
  }
}

template <typename T>
std::vector<T> values_of(const PlyFile& file, const std::string& name) {
  const auto column = file.cloud.column<T>(name);
  return {column.begin(), column.end()};
}

TEST(WritePly, MatchesAHandmadeFile) {
  const TemporaryFolder folder;
  PointCloud cloud(2);
  std::ranges::copy(std::array{1.0f, -2.0f}, cloud.add<float>("x").begin());
  std::ranges::copy(std::array<std::uint16_t, 2>{258, 3}, cloud.add<std::uint16_t>("ring").begin());
  write_ply(folder / "a.ply", cloud, {"origin_w 1 2 3", ""});
  EXPECT_EQ(
      bytes_of(folder / "a.ply"),
      "ply\nformat binary_little_endian 1.0\ncomment origin_w 1 2 3\ncomment \nelement vertex 2\n"
      "property float x\nproperty ushort ring\nend_header\n"
      "\0\0\x80\x3f\x02\x01\0\0\0\xc0\x03\0"s);
}

TEST(Ply, ReadsEveryWrittenBit) {
  const TemporaryFolder folder;
  const std::vector<std::string> comments{"origin_w 500000 5000000 0", "", "  end_header",
                                          "format ascii 1.0"};
  for (const std::size_t rows : {0, 1, 2, 1000, 50'000}) {  // the last spans several blocks
    const PointCloud cloud = random_cloud(rows);
    write_ply(folder / "a.ply", cloud, comments);
    const PlyFile read = read_ply(folder / "a.ply");
    expect_equal_bits(read.cloud, cloud);
    EXPECT_EQ(read.comments, comments);
  }
}

TEST(Ply, EmptyCloudsAreValidFiles) {
  const TemporaryFolder folder;
  write_ply(folder / "a.ply", PointCloud(), {});
  EXPECT_EQ(read_ply(folder / "a.ply").cloud.rows(), 0u);
}

const std::string ascii_file =
    "ply\nformat ascii 1.0\ncomment made by hand\nobj_info ignored\n"
    "element face 2\nproperty list uchar int vertex_indices\nproperty float quality\n"
    "element vertex 3\nproperty float64 x\nproperty float32 y\nproperty uint8 a\nproperty int8 "
    "b\nproperty int16 c\n"
    "property uint16 d\nproperty int32 e\nproperty uint32 f\nelement edge 1\nproperty int "
    "v\nend_header\n"
    "3 0 1 2 0.5\n0 1\n"
    "0.1 0.1 255 -128 -32768 65535 -2147483648 4294967295\n"
    "-1e300 -3e38\t0 127 32767 0 2147483647 0 \n"
    "nan inf +7 -0 1 2 3 4\n"
    "12\n";

TEST(ReadPly, ReadsAsciiOfEveryType) {
  for (const bool carriage_return : {false, true}) {
    std::string bytes;
    for (const char c : ascii_file)
      bytes += c == '\n' && carriage_return ? "\r\n"s : std::string(1, c);
    const PlyFile file = parse_ply(bytes, "a.ply");
    EXPECT_THAT(file.comments, ElementsAre("made by hand"));
    EXPECT_THAT(values_of<double>(file, "x"), ElementsAre(0.1, -1e300, ::testing::IsNan()));
    EXPECT_THAT(values_of<float>(file, "y"),
                ElementsAre(0.1f, -3e38f, std::numeric_limits<float>::infinity()));
    EXPECT_THAT(values_of<std::uint8_t>(file, "a"), ElementsAre(255, 0, 7));
    EXPECT_THAT(values_of<std::int8_t>(file, "b"), ElementsAre(-128, 127, 0));
    EXPECT_THAT(values_of<std::int16_t>(file, "c"), ElementsAre(-32768, 32767, 1));
    EXPECT_THAT(values_of<std::uint16_t>(file, "d"), ElementsAre(65535, 0, 2));
    EXPECT_THAT(values_of<std::int32_t>(file, "e"), ElementsAre(-2147483647 - 1, 2147483647, 3));
    EXPECT_THAT(values_of<std::uint32_t>(file, "f"), ElementsAre(4294967295u, 0, 4));
  }
}

const std::string big_endian_file =
    "ply\nformat binary_big_endian 1.0\n"
    "element tristrips 2\nproperty list ushort short strip\nproperty char tag\nproperty list uchar "
    "float weights\n"
    "element vertex 2\nproperty double x\nproperty float y\nproperty ushort d\nproperty int "
    "e\nproperty char b\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "\0\2\1\1\2\2\7\1\1\2\3\4"
    "\0\0\7\0"
    "\x3f\xf8\0\0\0\0\0\0\xbf\x80\0\0\1\2\xff\xff\xff\xfe\x80"
    "\x40\0\0\0\0\0\0\0\0\0\0\0\0\3\0\0\1\0\1"
    "\3\0\0\0\0\0\0\0\1\0\0\0\2"s;

TEST(ReadPly, ReadsBigEndianAfterLists) {
  const PlyFile file = parse_ply(big_endian_file, "a.ply");
  EXPECT_THAT(values_of<double>(file, "x"), ElementsAre(1.5, 2));
  EXPECT_THAT(values_of<float>(file, "y"), ElementsAre(-1, 0));
  EXPECT_THAT(values_of<std::uint16_t>(file, "d"), ElementsAre(258, 3));
  EXPECT_THAT(values_of<std::int32_t>(file, "e"), ElementsAre(-2, 256));
  EXPECT_THAT(values_of<std::int8_t>(file, "b"), ElementsAre(-128, 1));
}

TEST(ReadPly, ReadsLittleEndianAfterLists) {
  const PlyFile file = parse_ply(
      "ply\r\nformat binary_little_endian 1.0\r\nelement face 1\r\nproperty list int32 uint32 i\r\n"
      "element vertex 1\r\nproperty uint8 a\r\nend_header\r\n\2\0\0\0\1\1\1\1\2\2\2\2\x2a"s,
      "a.ply");
  EXPECT_THAT(values_of<std::uint8_t>(file, "a"), ElementsAre(42));
}

// Data after the vertices are ignored, so only they may be missing.
TEST(ReadPly, DetectsEveryTruncation) {
  const TemporaryFolder folder;
  write_ply(folder / "a.ply", random_cloud(3), {"origin_w 1 2 3"});
  const std::string written = bytes_of(folder / "a.ply");
  const std::pair<std::string, std::size_t> files[] = {
      {written, 0}, {ascii_file, "12\n"s.size()}, {big_endian_file, 13}};
  for (const auto& [bytes, ignored] : files) {
    EXPECT_NO_THROW(parse_ply(bytes, "a.ply"));
    for (std::size_t size = 0; size + ignored < bytes.size(); ++size) {
      EXPECT_THROW(parse_ply(bytes.substr(0, size), "a.ply"), Error) << size << " bytes";
    }
  }
}

TEST(ReadPly, ReportsLineAndRuleOfABadHeader) {
  const std::string start = "ply\nformat ascii 1.0\n";
  const std::string vertex = "element vertex 1\n";
  const std::tuple<std::string, const char*, const char*> files[] = {
      {"", "a.ply:0: ", "the first line must be 'ply'"},
      {"plyx\n", "a.ply:1: ", "the first line must be 'ply'"},
      {"ply\nformat binary 1.0\n", "a.ply:2: ", "the format must be ascii"},
      {"ply\nformat ascii 2.0\n", "a.ply:2: ", "the version 1.0"},
      {start + "format ascii 1.0\n", "a.ply:3: ", "the format is given twice"},
      {start + "\x1b]0;\n", "a.ply:3: ", "\"\\x1b]0;\" must be format, element"},
      {start + "\n", "a.ply:3: ", "\"\" must be format, element"},
      {start + vertex + "property float x\n", "a.ply:4: ", "lacks its last line, end_header"},
      {start + vertex + "property float x\nend_header",
       "a.ply:5: ", "lacks its last line, end_header"},
      {start + "element vertex\n", "a.ply:3: ", "an element must have a name and a count"},
      {start + "element vertex -1\n", "a.ply:3: ", "\"-1\" must be an integer"},
      {start + "element vertex 1.5\n", "a.ply:3: ", "\"1.5\" must be an integer"},
      {start + "element vertex 18446744073709551616\n",
       "a.ply:3: ", "must be an integer >= 0 and < 2^64"},
      {start + vertex + vertex, "a.ply:4: ", "the element 'vertex' is declared twice"},
      {start + "property float x\n", "a.ply:3: ", "a property must follow its element"},
      {start + vertex + "property half x\n", "a.ply:4: ", "\"half\" is not a PLY type"},
      {start + vertex + "property float\n", "a.ply:4: ", "a property must be '<type> <name>'"},
      {start + vertex + "property list uchar int\n",
       "a.ply:4: ", "a property must be '<type> <name>'"},
      {start + vertex + "property list uchar int i\n",
       "a.ply:4: ", "'i' of element vertex is a list"},
      {start + "element face 1\nproperty list float int i\n",
       "a.ply:4: ", "must be of an integer type, not float"},
      {start + vertex + "property float x\nproperty int x\n",
       "a.ply:5: ", "has two properties 'x'"},
      {start + "element face 0\nend_header\n", "a.ply:4: ", "must have an element vertex"},
      {"ply\nelement vertex 0\nend_header\n", "a.ply:3: ", "must name a format"},
      {start + vertex + "end_header\n1\n", "a.ply:4: ", "the element vertex has no property"},
  };
  for (const auto& [bytes, place, rule] : files)
    EXPECT_THAT(fault_in(bytes), AllOf(StartsWith(place), HasSubstr(rule)));
}

TEST(ReadPly, ReportsLineAndRuleOfABadRow) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty uchar a\nend_header\n";
  const std::tuple<std::string, const char*> bodies[] = {
      {"1 2\n3 256\n", "a.ply:8: a = \"256\" is not a number of type uchar"},
      {"1 2\n3 -1\n", "a.ply:8: a = \"-1\" is not a number of type uchar"},
      {"1 2\n3 4.0\n", "a.ply:8: a = \"4.0\" is not a number of type uchar"},
      {"1e39 2\n3 4\n", "a.ply:7: x = \"1e39\" is not a number of type float"},
      {"0,5 2\n3 4\n", "a.ply:7: x = \"0,5\" is not a number of type float"},
      {"1 2\n\n3 4\n",
       "a.ply:8: the row has 0 values; it must have one for each of the 2 properties"},
      {"1 2 3\n4 5\n", "a.ply:7: the row has 3 values"},
      {"1 2\n3 4\n5 6\n", "a.ply:8: 4 bytes follow the last row"},
      {"1 2\n3 44", "a.ply:8: the last line lacks its line break"},
      {"1 2 3 4\n", "a.ply:7: the row has 4 values"},
  };
  for (const auto& [body, message] : bodies)
    EXPECT_THAT(fault_in(header + body), StartsWith(message));
}

TEST(ReadPly, RejectsCountsBeyondTheFileSizeBeforeAllocating) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const char* count :
         {"3", "1000000000000", "4611686018427387904", "18446744073709551615"}) {
      const std::string start = fmt::format("ply\nformat {} 1.0\n", format);
      const std::string rest = fmt::format(" {}\nproperty int x\nend_header\n1 2\n\n", count);
      EXPECT_THAT(fault_in(fmt::format("{}element vertex{}", start, rest)),
                  HasSubstr("is the file truncated?"))
          << format;
      EXPECT_THAT(fault_in(fmt::format("{}element edge{}element vertex 1\nproperty int y\n{}",
                                       start, rest.substr(0, rest.find("end_header")),
                                       rest.substr(rest.find("end_header")))),
                  HasSubstr("is the file truncated?"))
          << format;
    }
  }
}

TEST(ReadPly, RejectsListsOfImpossibleLength) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list int double i\n"
      "element vertex 1\nproperty uchar a\nend_header\n";
  EXPECT_THAT(fault_in(header + "\xff\xff\xff\xff\1"s),
              StartsWith("a.ply: row 0 of element face has a list of -1 numbers"));
  EXPECT_THAT(fault_in(header + "\1\0\0\0\1\2\3\4\5\6\7"s),
              StartsWith("a.ply: the element face is truncated"));
}

TEST(ReadPly, RejectsBytesAfterTheLastRow) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar a\nend_header\n";
  EXPECT_NO_THROW(parse_ply(header + "a", "a.ply"));
  EXPECT_THAT(fault_in(header + "ab"),
              StartsWith("a.ply: 1 bytes follow the last row: is the count wrong?"));
}

TEST(ReadPly, NamesAMissingFile) {
  EXPECT_THAT(message_of([] { read_ply("/no/a.ply"); }),
              HasSubstr("/no/a.ply: there is no such file"));
}

TEST(WritePly, RejectsNamesThatTheHeaderCannotRepresent) {
  const TemporaryFolder folder;
  PointCloud cloud(1);
  cloud.add<float>("")[0] = 0;
  cloud.add<float>("range true")[0] = 0;
  EXPECT_THAT(message_of([&] {
                write_ply(folder / "a.ply", cloud, {"two\nlines", "return\r"});
              }),
              AllOf(HasSubstr("the name of column \"\" must"),
                    HasSubstr("the name of column \"range true\" must"),
                    HasSubstr("\"two\\nlines\" must be one line"),
                    HasSubstr("\"return\\r\" must be one line")));
  EXPECT_THAT(message_of([&] { write_ply(folder / "a.ply", PointCloud(5), {}); }),
              HasSubstr("the cloud has 5 rows but no column"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(WritePly, LeavesNoFileWhenTheFileSizeLimitIsExceeded) {
  const TemporaryFolder folder;
  const PointCloud cloud = random_cloud(50'000);
  const FileSizeLimit limit(1'000'000);  // within a block of rows, not the first
  EXPECT_THAT(message_of([&] { write_ply(folder / "a.ply", cloud, {}); }),
              HasSubstr("a.ply: cannot be written: File too large"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace groundray::ply_io_test
