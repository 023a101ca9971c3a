
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <span>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/npy_io.h"
#include "core/io/zip_reader.h"
#include "test/support/temporary_folder.h"

namespace groundray::npy_reader_test {
namespace {

using namespace std::string_literals;
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

std::filesystem::path corpus() {
  return testing::data_folder().parent_path() / "test/fuzz/corpus/npy";
}

template <typename T>
std::vector<T> values_of(const NpyArray& array, const std::string& name) {
  const auto column = array.cloud.column<T>(name);
  return {column.begin(), column.end()};
}

/// A file of version 1 with this header.
std::string npy(const std::string& header, const std::string& numbers) {
  std::string bytes = "\x93NUMPY\x01"s + '\0';
  bytes += static_cast<char>(header.size() % 256);
  bytes += static_cast<char>(header.size() / 256);
  return bytes + header + numbers;
}

std::string fault_in(const std::string& bytes) {
  return message_of([&] { parse_npy(bytes, "a.npy"); });
}

// The files of test/fuzz/corpus/npy were written by NumPy 2.4 from the expected values.
TEST(ReadNpy, ReadsStructuredArraysWrittenByNumpy) {
  const NpyArray array = read_npy(corpus() / "structured.npy");
  EXPECT_TRUE(array.is_structured);
  EXPECT_THAT(array.shape, ElementsAre(3u));
  EXPECT_THAT(values_of<float>(array, "x"), ElementsAre(1, 2.5f, -3));
  EXPECT_THAT(values_of<double>(array, "y"), ElementsAre(0.1, 0.2, 1e300));  // big endian
  EXPECT_THAT(values_of<double>(array, "t"), ElementsAre(0, 5, 100));
  ASSERT_EQ(array.origins.size(), 1u);
  EXPECT_EQ(array.origins[0].origin, 1673400471837873222);
  EXPECT_THAT(array.unread, ElementsAre("name"));
  EXPECT_THAT(values_of<float>(array, "n_0"), ElementsAre(1, 3, 5));
  EXPECT_THAT(values_of<float>(array, "n_1"), ElementsAre(2, 4, 6));
  EXPECT_THAT(values_of<float>(array, "h"), ElementsAre(0.5f, -65504, 0x1p-24f));  // 6e-8: 2^-24
  EXPECT_THAT(values_of<std::uint8_t>(array, "b"), ElementsAre(1, 0, 1));
}

TEST(ReadNpy, ReadsFortranOrderAndBigEndian) {
  const NpyArray array = read_npy(corpus() / "fortran.npy");
  EXPECT_THAT(array.shape, ElementsAre(5u, 3u));
  for (std::int16_t k = 0; k < 3; ++k) {
    EXPECT_THAT(values_of<std::int16_t>(array, std::to_string(k)),
                ElementsAre(k, k + 3, k + 6, k + 9, k + 12));
  }
}

TEST(ReadNpy, ReadsBackWrittenArrays) {
  const testing::TemporaryFolder folder;
  const std::array<double, 4> values{1, -2, 3, 1e-300};
  write_npy(folder / "a.npy", {{"a", "<f8"}, {"b", "<f8"}}, 2, std::as_bytes(std::span(values)));
  const NpyArray array = read_npy(folder / "a.npy");
  EXPECT_THAT(values_of<double>(array, "a"), ElementsAre(1, 3));
  EXPECT_THAT(values_of<double>(array, "b"), ElementsAre(-2, 1e-300));
}

TEST(ReadNpy, ReadsZeroOneAndThreeDimensions) {
  const std::string bytes("\1\2\3\4\5\6\7\10", 8);
  const NpyArray one =
      parse_npy(npy("{'descr': '|u1', 'fortran_order': False, 'shape': (8,), }", bytes), "a");
  EXPECT_THAT(values_of<std::uint8_t>(one, ""), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  const NpyArray none =
      parse_npy(npy("{'descr': '|u1', 'fortran_order': False, 'shape': ()}", "\7"), "a");
  EXPECT_THAT(values_of<std::uint8_t>(none, ""), ElementsAre(7));
  // In Fortran order, element (i, j, k) lies at i + 2 j + 4 k.
  const NpyArray three =
      parse_npy(npy("{'descr': '|u1', 'fortran_order': True, 'shape': (2, 2, 2)}", bytes), "a");
  EXPECT_THAT(values_of<std::uint8_t>(three, "0"), ElementsAre(1, 3, 2, 4));
  EXPECT_THAT(values_of<std::uint8_t>(three, "1"), ElementsAre(5, 7, 6, 8));
}

TEST(ReadNpy, ShiftsIntegersBeyondThePrecisionOfDoubles) {
  std::array<std::int64_t, 3> stamps{-9'000'000'000'000'000'001, -9'000'000'000'000'000'000,
                                     -8'999'999'999'999'999'000};
  const auto parse = [&stamps] {
    return parse_npy(npy("{'descr': '<i8', 'fortran_order': False, 'shape': (3,)}",
                         {reinterpret_cast<const char*>(stamps.data()), sizeof stamps}),
                     "a");
  };
  EXPECT_THAT(values_of<double>(parse(), ""), ElementsAre(0, 1, 1001));
  EXPECT_EQ(parse().origins[0].origin, stamps[0]);
  stamps = {std::numeric_limits<std::int64_t>::min(), 0, std::numeric_limits<std::int64_t>::max()};
  EXPECT_THAT(values_of<double>(parse(), ""), ElementsAre(-0x1p63, 0, 0x1p63));
  EXPECT_TRUE(parse().origins.empty());
  stamps = {-5, 0, 5};
  EXPECT_THAT(values_of<double>(parse(), ""), ElementsAre(-5, 0, 5));
}

TEST(ReadNpz, ReadsArchivesWrittenByNumpy) {
  const NpzFile stored = read_npz(corpus() / "stored.npz");
  ASSERT_EQ(stored.arrays.size(), 3u);
  EXPECT_EQ(stored.arrays[0].name, "xyz");
  EXPECT_THAT(stored.arrays[0].shape, ElementsAre(4u, 3u));
  EXPECT_THAT(values_of<float>(stored.arrays[0], "2"), ElementsAre(-1.25f, -1.25f, -1.25f, -1.25f));
  EXPECT_EQ(stored.arrays[1].name, "ring");
  EXPECT_THAT(values_of<std::uint16_t>(stored.arrays[1], ""), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(values_of<double>(stored.arrays[2], ""), ElementsAre(2));
  EXPECT_THAT(stored.unread, ElementsAre(std::pair("names"s, "it contains no numbers"s)));
  const NpzFile deflated = read_npz(corpus() / "deflated.npz");
  ASSERT_EQ(deflated.arrays.size(), 3u);
  EXPECT_EQ(deflated.arrays[0].cloud.column<double>("")[99], 99);
  EXPECT_EQ(deflated.arrays[2].cloud.column<double>("")[99], 1);
  EXPECT_THAT(deflated.unread, ElementsAre(std::pair("pickled"s, "it contains Python objects"s)));
}

TEST(ReadNpz, DetectsDamage) {
  for (const char* name : {"stored.npz", "deflated.npz"}) {
    const std::string bytes = read_text(corpus() / name);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      EXPECT_THROW(parse_npz(bytes.substr(0, size), "a.npz"), Error) << name << " " << size;
    }
    for (const ZipMember& member : zip_members(bytes)) {
      std::string damaged = bytes;
      damaged[member.header + 100] = static_cast<char>(damaged[member.header + 100] ^ 1);
      EXPECT_THROW(unpack_member(damaged, member), Error) << name;
    }
  }
}

// PKWARE's APPNOTE 4.3.14 to 4.3.16 and 4.5.3: for sizes and counts of all ones, ZIP64 holds the
// values.
TEST(ZipReader, ReadsHandmadeZip64) {
  const auto number = [](std::uint64_t value, std::size_t bytes) {
    return std::string(reinterpret_cast<const char*>(&value), bytes);
  };
  constexpr std::uint32_t ones = 0xffffffff, crc_of_abc = 0x352441c2;
  const std::string local = "PK\3\4" + number(45, 2) + number(0, 2) + number(0, 2) + number(0, 4) +
                            number(crc_of_abc, 4) + number(ones, 4) + number(ones, 4) +
                            number(1, 2) + number(0, 2) + "a" + "abc";
  const std::string extra = number(9, 2) + number(1, 2) + "x" + number(1, 2) + number(24, 2) +
                            number(3, 8) + number(3, 8) + number(0, 8);
  const std::string entry = "PK\1\2" + number(45, 2) + number(45, 2) + number(0, 8) +
                            number(crc_of_abc, 4) + number(ones, 4) + number(ones, 4) +
                            number(1, 2) + number(extra.size(), 2) + number(0, 8) + number(0, 2) +
                            number(ones, 4) + "a" + extra;
  const std::string end64 = "PK\6\6" + number(44, 8) + number(45, 2) + number(45, 2) +
                            number(0, 8) + number(1, 8) + number(1, 8) + number(entry.size(), 8) +
                            number(local.size(), 8);
  const std::string locator =
      "PK\6\7" + number(0, 4) + number(local.size() + entry.size(), 8) + number(1, 4);
  const std::string end = "PK\5\6" + number(0, 4) + number(0xffffffff, 4) + number(ones, 4) +
                          number(ones, 4) + number(2, 2) + "PK";
  const std::string bytes = local + entry + end64 + locator + end;
  const auto members = zip_members(bytes);
  ASSERT_EQ(members.size(), 1u);
  EXPECT_EQ(members[0].name, "a");
  EXPECT_EQ(unpack_member(bytes, members[0]), "abc");
}

TEST(ReadNpy, DetectsEveryTruncation) {
  for (const char* name : {"structured.npy", "fortran.npy"}) {
    const std::string bytes = read_text(corpus() / name);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      EXPECT_THROW(parse_npy(bytes.substr(0, size), "a.npy"), Error) << name << " " << size;
    }
    EXPECT_THROW(parse_npy(bytes + "x", "a.npy"), Error);
  }
}

TEST(ReadNpy, ReportsTheRuleThatAHeaderBreaks) {
  const std::string end = ", 'fortran_order': False, 'shape': (2,)}";
  const std::pair<std::string, const char*> files[] = {
      {"PK", "is it a .npy file?"},
      {"\x93NUMPY\x04"s + std::string(10, '\0'), "version 4 of the format is not supported"},
      {npy("  ", ""), "cannot be read"},
      {npy("{'descr': '<f4'" + end + " x", ""), "cannot be read at \"x\""},
      {npy("{'descr': '<f4', 'shape': (2,)}", ""), "must have descr, fortran_order and shape"},
      {npy("{'descr': '<f4', 'fortran_order': False, 'shape': 2}", ""), "a tuple of integers"},
      {npy("{'descr': '<f4', 'fortran_order': False, 'shape': (-2,)}", ""), "integers >= 0"},
      {npy("{'descr': 'f4'" + end, ""), "\"f4\" is not a NumPy type"},
      {npy("{'descr': '<f99999999999'" + end, ""), "is not a NumPy type"},
      {npy("{'descr': '<c8'" + end, std::string(16, '\0')), "it contains no numbers"},
      {npy("{'descr': '|O'" + end, "pickle"), "it contains Python objects"},
      {npy("{'descr': [('p', [('x', '<f4')])]" + end, ""), "a nested record"},
      {npy("{'descr': '<f4'" + end, "1234"), "2 numbers or rows of 4 bytes, but 4 bytes follow"},
      {npy("{'descr': '<f4', 'fortran_order': False, 'shape': (281474976710656, 4)}", ""),
       "more than 2^48"},
      {npy("{'descr': [('a', '<f4', (5000,))]" + end, ""), "more than 4096 numbers"},
      {npy("{'descr': " + std::string(100, '(') + end, ""), "cannot be read"},
  };
  for (const auto& [bytes, rule] : files) EXPECT_THAT(fault_in(bytes), HasSubstr(rule));
  EXPECT_THAT(fault_in("PK"), StartsWith("a.npy: "));
}

}  // namespace
}  // namespace groundray::npy_reader_test
