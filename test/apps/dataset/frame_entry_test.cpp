#include "apps/dataset/frame_entry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <random>
#include <string>
#include <utility>

namespace groundray::frame_entry_test {
namespace {

using std::chrono::nanoseconds;

const std::string empty_digits =
    "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";  // SHA-256 of the empty
                                                                         // string

// The example of docs/reference/formats.md.
const std::string done_line =
    R"({sensor: "top", frame: 3, stamp_s: 0.300036096, state: done, )"
    R"(convergence: {pulses: 12, other_echoes: 0, range_rms_m: 1e-05, range_max_m: 0.01}, )"
    R"(files: {"_preview.png": {bytes: 17, sha256: ")" +
    empty_digits + R"("}, ".ply": {bytes: 0, sha256: ")" + empty_digits + R"("}}})";

TEST(FrameEntry, ParsesItsLine) {
  const auto entry = parse_entry(done_line);
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->sensor, "top");
  EXPECT_EQ(entry->frame, 3);
  EXPECT_EQ(entry->stamp, nanoseconds(300'036'096));
  EXPECT_TRUE(entry->is_done);
  EXPECT_EQ(entry->convergence,
            "{pulses: 12, other_echoes: 0, range_rms_m: 1e-05, range_max_m: 0.01}");
  ASSERT_EQ(entry->files.size(), 2u);
  EXPECT_EQ(entry->files[0].suffix, "_preview.png");
  EXPECT_EQ(entry->files[0].sum.bytes, 17u);
  EXPECT_EQ(entry->files[1].suffix, ".ply");
  EXPECT_EQ(entry->files[1].sum.sha256, empty_digits);
  EXPECT_EQ(text_of(*entry), done_line);
}

TEST(FrameEntry, PendingFramesHaveNoFiles) {
  const std::string line = R"({sensor: "a-b_1", frame: 0, stamp_s: -0.000000001, state: pending})";
  const auto entry = parse_entry(line);
  ASSERT_TRUE(entry);
  EXPECT_FALSE(entry->is_done);
  EXPECT_EQ(entry->stamp, nanoseconds(-1));
  EXPECT_TRUE(entry->files.empty());
  EXPECT_EQ(text_of(*entry), line);
  EXPECT_TRUE(parse_entry(R"({sensor: "a", frame: 0, stamp_s: 0.000000000, state: done})"))
      << "an earlier version wrote no checksums";
}

TEST(FrameEntry, RejectsTruncatedLines) {
  for (std::size_t size = 0; size < done_line.size(); ++size)
    EXPECT_FALSE(parse_entry(done_line.substr(0, size))) << size;
  EXPECT_FALSE(parse_entry(done_line + " "));
  EXPECT_FALSE(parse_entry(done_line + "\n"));
}

TEST(FrameEntry, RejectsMalformedLines) {
  for (const auto& [old, now] : {std::pair<std::string, std::string>{"\"top\"", "\"../top\""},
                                 {"\"top\"", "\"\""},
                                 {"frame: 3", "frame: -3"},
                                 {"frame: 3", "frame: 03"},
                                 {"frame: 3", "frame: 99999999999999999999"},
                                 {"0.300036096", "1e300"},
                                 {"0.300036096", "nan"},
                                 {"0.300036096", "0.3.0"},
                                 {"state: done", "state: pending"},
                                 {"state: done", "state: gone"},
                                 {"\".ply\"", "\"/../../.ply\""},
                                 {"bytes: 17", "bytes: -17"},
                                 {"bytes: 17", "bytes: 0x11"},
                                 {"855\"}}}", "85\"}}}"},
                                 {"855\"}}}", "8555\"}}}"},
                                 {"855\"}}}", "85G\"}}}"},
                                 {"855\"}}}", "85A\"}}}"}}) {
    std::string line = done_line;
    ASSERT_NE(line.find(old), std::string::npos) << old;
    line.replace(line.find(old), old.size(), now);
    EXPECT_FALSE(parse_entry(line)) << line;
  }
}

// Whatever the damage to a line, an entry that is read from it can be written and read again.
TEST(FrameEntry, ParsedEntriesRoundTrip) {
  std::mt19937 random(3);
  std::size_t read = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string line = done_line;
    for (unsigned k = 0; k < 1 + random() % 3; ++k) {
      const std::size_t at = random() % line.size();
      if (random() % 2 == 0)
        line[at] = static_cast<char>(random() % 128);
      else
        line.erase(at, 1 + random() % 4);
    }
    const auto entry = parse_entry(line);
    if (!entry) continue;
    ++read;
    const std::string again = text_of(*entry);
    ASSERT_TRUE(parse_entry(again)) << line;
    EXPECT_EQ(text_of(*parse_entry(again)), again) << line;
  }
  EXPECT_GT(read, 100u);
}

TEST(NamedSum, AcceptsOnlyFilesInFoldersOfTheDataset) {
  const std::string line = R"({path: "poses/top.tum", bytes: 5, sha256: ")" + empty_digits + "\"}";
  const auto file = parse_named_sum(line);
  ASSERT_TRUE(file);
  EXPECT_EQ(file->path, "poses/top.tum");
  EXPECT_EQ(file->sum.bytes, 5u);
  EXPECT_EQ(text_of(*file), line);
  for (const char* const path :
       {"top.tum", "/top.tum", "../top.tum", "poses/..", "poses/a/b", "poses/", "poses/.hidden"}) {
    std::string other = line;
    other.replace(other.find("poses/top.tum"), 13, path);
    EXPECT_FALSE(parse_named_sum(other)) << path;
  }
}

}  // namespace
}  // namespace groundray::frame_entry_test
