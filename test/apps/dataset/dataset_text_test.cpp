#include "apps/dataset/dataset_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::dataset_text_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

const std::string header = "groundray_dataset: 1\nscene: \"frames:\\n\"\nsensors:\n  - {name: a}\n";
const std::vector<std::string> entries{"{sensor: \"a\", frame: 0}", "{sensor: \"a\", frame: 1}"};
const std::vector<NamedSum> files{{"poses/a.tum", {3, sha256_of("abc")}}};

void write(const std::filesystem::path& folder, const std::optional<Shard>& shard = {}) {
  std::size_t next = 0;
  write_dataset_text(
      folder, header, {.shard = shard, .choice = {}},
      [&] { return next < entries.size() ? std::optional(entries[next++]) : std::nullopt; }, files);
}

std::vector<std::string> read_entries(DatasetText& text) {
  std::vector<std::string> read;
  while (const auto entry = text.next_entry()) read.push_back(*entry);
  return read;
}

TEST(DatasetText, RoundTrips) {
  const testing::TemporaryFolder folder;
  for (const std::optional<Shard>& shard : {std::optional<Shard>(), std::optional(Shard{2, 3})}) {
    write(folder.path(), shard);
    DatasetText text(folder.path());
    EXPECT_EQ(text.header(), header);
    EXPECT_EQ(text.shard(), shard);
    EXPECT_EQ(read_entries(text), entries);
    EXPECT_FALSE(text.next_entry());
    ASSERT_EQ(text.files().size(), 1u);
    EXPECT_EQ(text.files()[0].path, "poses/a.tum");
    EXPECT_EQ(text.files()[0].sum, files[0].sum);
    EXPECT_TRUE(text.is_intact());
  }
}

TEST(DatasetText, EndsWithTheChecksumOfAllLinesAbove) {
  const testing::TemporaryFolder folder;
  write(folder.path());
  const std::string text = read_text(folder / "dataset.yaml");
  const std::size_t last = text.find("sha256_above");
  EXPECT_EQ(text.substr(last), "sha256_above: \"" + sha256_of(text.substr(0, last)) + "\"\n");
}

TEST(DatasetText, DetectsChangesAndTruncation) {
  const testing::TemporaryFolder folder;
  write(folder.path());
  const std::string whole = read_text(folder / "dataset.yaml");
  const auto is_intact = [&](const std::string& now) {
    write_text(folder / "dataset.yaml", now);
    try {
      DatasetText text(folder.path());
      read_entries(text);
      return text.is_intact();
    } catch (const Error&) {
      return false;
    }
  };
  EXPECT_TRUE(is_intact(whole));
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string flipped = whole;
    flipped[i] = static_cast<char>(flipped[i] ^ (1 << (i % 8)));
    EXPECT_FALSE(is_intact(flipped)) << i;
    EXPECT_FALSE(is_intact(whole.substr(0, i))) << i;
  }
  EXPECT_FALSE(is_intact(whole + "\n"));
  EXPECT_FALSE(is_intact(whole + whole.substr(whole.find("sha256_above"))));
}

// A damaged line hides none of the lines after it: each is passed on, either as an entry or to be
// rejected.
TEST(DatasetText, ReadsAllFramesAfterAChangedLine) {
  const testing::TemporaryFolder folder;
  write(folder.path());
  const std::string whole = read_text(folder / "dataset.yaml");
  const std::string marker = "  - {sensor: \"a\", frame: 0}";
  for (const std::string bad : {"  + {sensor: \"a\", frame: 0}", " - {sensor", "", "filez:"}) {
    std::string text = whole;
    write_text(folder / "dataset.yaml", text.replace(text.find(marker), marker.size(), bad));
    DatasetText read(folder.path());
    EXPECT_THAT(read_entries(read), ElementsAre(bad, entries[1]));
    EXPECT_FALSE(parse_entry(bad));
    EXPECT_EQ(read.files().size(), 1u);
    EXPECT_FALSE(read.is_intact());
  }
}

TEST(DatasetText, QuotesTheFirstDifferingLine) {
  EXPECT_EQ(first_difference("a: 1\nb: 2\nc: 3\n", "a: 1\nb: 7\nc: 4\n"),
            "'b: 2' instead of 'b: 7'");
  EXPECT_EQ(first_difference("x: 1\n", "a: 1\n"), "'x: 1' instead of 'a: 1'");
  EXPECT_EQ(first_difference("a: 1\n", "a: 1\nb: 2\n"), "'' instead of 'b: 2'");
  EXPECT_EQ(first_difference("", "a: 1"), "'' instead of 'a: 1'");
  const std::string blanks(100, ' ');
  EXPECT_EQ(first_difference(blanks + "1" + blanks, blanks + "2" + blanks),
            "'" + blanks.substr(0, 40) + "1" + blanks.substr(0, 39) + "' instead of '" +
                blanks.substr(0, 40) + "2" + blanks.substr(0, 39) + "'");
}

TEST(DatasetText, ReadsEarlierVersionsWithoutChecksums) {
  const testing::TemporaryFolder folder;
  write_text(folder / "dataset.yaml", header + "frames:\n  - {sensor: a, frame: 0}\n");
  DatasetText text(folder.path());
  EXPECT_THAT(read_entries(text), ElementsAre("{sensor: a, frame: 0}"));
  EXPECT_EQ(text.line(), 6u);
  EXPECT_THAT(text.files(), IsEmpty());
  EXPECT_FALSE(text.is_intact());
}

TEST(DatasetText, RejectsMissingFilesAndMissingFrameLists) {
  const testing::TemporaryFolder folder;
  const auto open = [&] { DatasetText text(folder.path()); };
  EXPECT_THAT(open, ThrowsMessage<Error>(HasSubstr("contains no dataset.yaml")));
  write_text(folder / "dataset.yaml", header);
  EXPECT_THAT(open, ThrowsMessage<Error>(HasSubstr("no frames are listed")));
}

}  // namespace
}  // namespace groundray::dataset_text_test
