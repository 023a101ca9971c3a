#include "apps/dataset/write/journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/io/file_io.h"
#include "test/support/file_size_limit.h"
#include "test/support/temporary_folder.h"

namespace groundray::journal_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

struct Read {
  std::vector<std::string> entries;
  std::size_t torn = 0;
};

Read read(const std::filesystem::path& path) {
  Read result;
  result.torn =
      read_journal(path, [&](const std::string& entry) { result.entries.push_back(entry); });
  return result;
}

TEST(Journal, ReturnsEntriesInOrder) {
  const testing::TemporaryFolder folder;
  const std::vector<std::string> entries{"{a}", std::string(10'000, 'b'), "{c d}", "{a}"};
  Journal journal(folder / "journal");
  std::vector<std::uint64_t> places;
  for (const std::string& entry : entries) {
    places.push_back(journal.add(entry));
    EXPECT_EQ(read(folder / "journal").entries.back(), entry) << "at once";
  }
  for (std::size_t i = entries.size(); i-- > 0;) EXPECT_EQ(journal.at(places[i]), entries[i]);
  EXPECT_EQ(read(folder / "journal").entries, entries);
  EXPECT_EQ(read(folder / "journal").torn, 0u);
}

TEST(Journal, ReplacesThePreviousJournal) {
  const testing::TemporaryFolder folder;
  Journal before(folder / "journal");
  before.add("old");
  Journal now(folder / "aside");
  const std::uint64_t place = now.add("new");
  now.rename_to(folder / "journal");
  EXPECT_EQ(now.at(place), "new");
  now.add("newer");
  EXPECT_THAT(read(folder / "journal").entries, ElementsAre("new", "newer"));
  EXPECT_FALSE(std::filesystem::exists(folder / "aside"));
  now.remove();
  EXPECT_FALSE(std::filesystem::exists(folder / "journal"));
}

// A process that is killed while it writes leaves the beginning of its line.
TEST(Journal, KeepsCompleteLinesIfTruncated) {
  const testing::TemporaryFolder folder;
  {
    Journal journal(folder / "journal");
    for (const char* const entry : {"first", "second", "third"}) journal.add(entry);
  }
  const std::string text = read_text(folder / "journal");
  for (std::size_t size = 0; size < text.size(); ++size) {
    write_text(folder / "cut", text.substr(0, size));
    const auto lines = static_cast<std::size_t>(std::ranges::count(text.substr(0, size), '\n'));
    const Read cut = read(folder / "cut");
    // A line that lacks only its line break is complete.
    const bool is_whole = text[size] == '\n';
    EXPECT_EQ(cut.entries.size(), lines + (is_whole ? 1 : 0)) << size;
    const bool is_torn = !is_whole && size > 0 && text[size - 1] != '\n';
    EXPECT_EQ(cut.torn, is_torn ? 1u : 0u) << size;
  }
}

// After a power failure the file may hold anything.
TEST(Journal, DropsChangedLines) {
  const testing::TemporaryFolder folder;
  {
    Journal journal(folder / "journal");
    for (const char* const entry : {"first", "second", "third"}) journal.add(entry);
  }
  const std::string text = read_text(folder / "journal");
  for (std::size_t i = 0; i < 8 * text.size(); ++i) {
    std::string flipped = text;
    flipped[i / 8] = static_cast<char>(flipped[i / 8] ^ (1 << (i % 8)));
    write_text(folder / "flipped", flipped);
    const Read found = read(folder / "flipped");
    EXPECT_LE(found.entries.size(), 2u) << i;
    EXPECT_GE(found.torn, 1u) << i;
    for (const std::string& entry : found.entries)
      EXPECT_TRUE(entry == "first" || entry == "second" || entry == "third") << entry;
  }
}

TEST(Journal, RejectsUnusableFiles) {
  const testing::TemporaryFolder folder;
  EXPECT_THAT([&] { Journal journal(folder / "no/journal"); },
              ThrowsMessage<Error>(HasSubstr("cannot be written")));
  EXPECT_THAT([&] { read_journal(folder / "none", [](const std::string&) {}); },
              ThrowsMessage<Error>(HasSubstr("none: there is no such file or folder")));
  EXPECT_THAT([&] { Journal journal("/dev/full"); },
              ThrowsMessage<Error>(HasSubstr("/dev/full: cannot be written")));
  Journal journal(folder / "journal");
  const testing::FileSizeLimit limit(4);
  EXPECT_THAT([&] { journal.add("entry"); }, ThrowsMessage<Error>(HasSubstr("cannot be written")));
}

}  // namespace
}  // namespace groundray::journal_test
