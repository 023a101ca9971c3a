#include "core/io/open_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>
#include <system_error>

#include "core/error.h"
#include "core/folder_names.h"
#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::open_file_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;

TEST(CreateFile, ReplacesLinksAndLeavesWhatTheyNameAlone) {
  const TemporaryFolder folder;
  const fs::path victim = folder / "victim";
  for (const bool is_hard : {false, true}) {
    write_text(victim, "precious");
    const fs::path link = folder / "link";
    if (is_hard)
      fs::create_hard_link(victim, link);
    else
      fs::create_symlink(victim, link);
    close(create_file(link));
    EXPECT_EQ(read_text(victim), "precious");
    EXPECT_FALSE(fs::is_symlink(link));
    EXPECT_EQ(read_text(link), "");
    EXPECT_EQ(fs::hard_link_count(victim), 1u);
    fs::remove(link);
  }
  fs::create_symlink(folder / "nowhere", folder / "dangling");
  close(create_file(folder / "dangling"));
  EXPECT_FALSE(fs::exists(folder / "nowhere"));
}

TEST(CreateFile, FoldersPipesAndDevicesAreNotReplaced) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THROW(create_file(folder / "pipe"), std::system_error);
  EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
  fs::create_directory(folder / "a");
  EXPECT_THROW(create_file(folder / "a"), std::system_error);
  EXPECT_THROW(create_file(folder / "no" / "a"), std::system_error);
}

TEST(WriteWhole, DoesNotWriteThroughLinksAtItsTemporaryName) {
  const TemporaryFolder folder;
  const fs::path victim = folder / "victim";
  write_text(victim, "precious");
  fs::create_symlink(victim, folder / "a.txt.part");
  write_text(folder / "a.txt", "new");
  EXPECT_EQ(read_text(victim), "precious");
  EXPECT_EQ(read_text(folder / "a.txt"), "new");
  fs::create_hard_link(victim, folder / "a.txt.part");
  write_text(folder / "a.txt", "newer");
  EXPECT_EQ(read_text(victim), "precious");
}

TEST(OpenFile, TakesRegularFilesAlone) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  fs::create_directory(folder / "folder");
  fs::create_symlink("/dev/zero", folder / "zeros");
  EXPECT_THAT([&] { read_text(folder / "pipe"); },
              ThrowsMessage<Error>(HasSubstr("pipe: it is a pipe or device")));
  EXPECT_THAT([&] { read_text(folder / "zeros"); },
              ThrowsMessage<Error>(HasSubstr("zeros: it is a pipe or device")));
  EXPECT_THAT([&] { read_text(folder / "folder"); },
              ThrowsMessage<Error>(HasSubstr("folder: it is a folder, but must be a file")));
  EXPECT_THAT([&] { read_text(folder / "none"); },
              ThrowsMessage<Error>(HasSubstr("none: there is no such file or folder")));
  for (const char* name : {"pipe", "zeros", "folder", "none"})
    EXPECT_FALSE(open_stream(folder / name)) << name;
}

TEST(OpenFile, FollowsLinksToRegularFiles) {
  const TemporaryFolder folder;
  write_text(folder / "a", "text");
  fs::create_symlink("a", folder / "b");
  EXPECT_EQ(read_text(folder / "b"), "text");
  std::string word;
  open_stream(folder / "b") >> word;
  EXPECT_EQ(word, "text");
}

TEST(NamesIn, AreSortedAndFaultsAreReported) {
  const TemporaryFolder folder;
  for (const char* name : {"b", "a", ".hidden"}) write_text(folder / name, "");
  fs::create_directory(folder / "c");
  fs::create_symlink("nowhere", folder / "d");
  std::error_code fault;
  EXPECT_THAT(names_in(folder / "", fault), ::testing::ElementsAre(".hidden", "a", "b", "c", "d"));
  EXPECT_FALSE(fault);
  EXPECT_TRUE(names_in(folder / "a", fault).empty());
  EXPECT_EQ(fault, std::errc::not_a_directory);
  EXPECT_TRUE(names_in(folder / "e", fault).empty());
  EXPECT_EQ(fault, std::errc::no_such_file_or_directory);
}

TEST(NextLine, ReadsAsGetlineDoesExceptEndlessLines) {
  for (const std::string text : {"", "\n", "a", "a\n", "a\n\nb", "a\r\n\0b\n"}) {
    std::istringstream ours(text), theirs(text);
    std::string line, expected;
    while (std::getline(theirs, expected)) {
      ASSERT_TRUE(next_line(ours, line));
      EXPECT_EQ(line, expected);
      EXPECT_EQ(ours.eof(), theirs.eof());
    }
    EXPECT_FALSE(next_line(ours, line));
    EXPECT_TRUE(ours.eof() && ours.fail() && !ours.bad());
  }
  const TemporaryFolder folder;
  write_text(folder / "sparse", "");
  fs::resize_file(folder / "sparse", std::uintmax_t{1} << 40);
  std::ifstream sparse = open_stream(folder / "sparse");
  std::string line;
  EXPECT_FALSE(next_line(sparse, line));
}

}  // namespace
}  // namespace groundray::open_file_test
