#include "apps/dataset/packed_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdint>
#include <fstream>
#include <random>
#include <string>

#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::packed_file_test {
namespace {

using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

// Packs bytes with zlib's own file writer.
std::string packed(const std::string& bytes) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "a.gz";
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string refusal(const std::string& bytes) {
  try {
    unpack(bytes, "a.ply.gz");
  } catch (const Error& fault) {
    return fault.what();
  }
  return "";
}

std::string noise(std::size_t bytes) {
  std::mt19937 random(1);
  std::string out;
  for (std::size_t i = 0; i < bytes; ++i) out.push_back(static_cast<char>(random() & 0xff));
  return out;
}

TEST(PackedFile, RoundTrips) {
  for (const std::string& bytes :
       {std::string(), std::string("ply\n"), noise(3'000'000), std::string(5'000'000, '\0')}) {
    EXPECT_EQ(unpack(packed(bytes), "a"), bytes);
    const TemporaryFolder folder;
    std::ofstream(folder / "a.gz", std::ios::binary) << packed(bytes);
    std::ofstream(folder / "a.ply", std::ios::binary) << bytes;
    EXPECT_EQ(read_packed(folder / "a.gz"), bytes);
    EXPECT_EQ(read_packed(folder / "a.ply"), bytes);
  }
}

// As in gunzip, members follow each other, and zeros at the end are padding.
TEST(PackedFile, ReadsConcatenatedMembers) {
  const std::string both = packed("one ") + packed(noise(2'000'000)) + packed("");
  EXPECT_EQ(unpack(both, "a"), "one " + noise(2'000'000));
  EXPECT_EQ(unpack(both + std::string(100, '\0'), "a"), "one " + noise(2'000'000));
  EXPECT_THAT(refusal(both + "more"), HasSubstr("a.ply.gz: it is damaged"));
}

TEST(PackedFile, RejectsTruncatedAndDamagedData) {
  const std::string whole = packed(noise(5000));
  EXPECT_EQ(refusal(whole), "");
  for (std::size_t size = 2; size < whole.size(); size += 41)
    EXPECT_THAT(refusal(whole.substr(0, size)), HasSubstr("a.ply.gz: it is truncated")) << size;
  std::string bad = whole;
  bad[whole.size() / 2] ^= 1;  // detected by the checksum
  EXPECT_THAT(refusal(bad), HasSubstr("a.ply.gz: it is damaged"));
  for (const std::string text : {"", "\x1f", "ply\n"})
    EXPECT_THAT(refusal(text), HasSubstr("it is not in gzip format"));
}

}  // namespace
}  // namespace groundray::packed_file_test
