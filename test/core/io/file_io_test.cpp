#include "core/io/file_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <sys/mount.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "core/error.h"
#include "test/support/file_size_limit.h"
#include "test/support/temporary_folder.h"

namespace groundray::file_io_test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using testing::FileSizeLimit;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TemporaryFolder;

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  return names;
}

std::string bytes_of(const fs::path& path) {
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

/// An in-memory file system of 64 KiB, if this process may mount one.
class SmallDisk {
 public:
  SmallDisk() : reason_(mount("groundray", path(), "tmpfs", 0, "size=64k") == 0 ? 0 : errno) {}
  ~SmallDisk() {
    if (reason_ == 0) umount2(path(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  const char* path() const { return folder_.path().c_str(); }
  /// Reason why the mount failed: an errno, or 0 if it succeeded.
  int reason() const { return reason_; }

 private:
  TemporaryFolder folder_;
  int reason_;
};

TEST(WriteWhole, ReplacesAnExistingFile) {
  const TemporaryFolder folder;
  write_text(folder / "a.txt", "a long first text");
  write_text(folder / "a.txt", "second");
  EXPECT_EQ(bytes_of(folder / "a.txt"), "second");
  EXPECT_THAT(names_in(folder.path()), ElementsAre("a.txt"));
}

TEST(WriteWhole, KeepsTheOldFileIfTheWriterThrows) {
  const TemporaryFolder folder;
  write_text(folder / "a.txt", "old");
  const auto fail = [](const fs::path& aside) {
    std::ofstream(aside) << "half";
    throw Error("the writer failed");
  };
  EXPECT_EQ(message_of([&] { write_whole(folder / "a.txt", fail); }), "the writer failed");
  EXPECT_EQ(bytes_of(folder / "a.txt"), "old");
  EXPECT_THAT(names_in(folder.path()), ElementsAre("a.txt"));
}

TEST(WriteWhole, PublishesTheFileOnlyWhenComplete) {
  const TemporaryFolder folder;
  write_whole(folder / "a.txt", [&](const fs::path& aside) {
    std::ofstream(aside) << "all";
    EXPECT_FALSE(fs::exists(folder / "a.txt"));
  });
  EXPECT_EQ(bytes_of(folder / "a.txt"), "all");
}

TEST(WriteWhole, OverwritesTheTemporaryFileOfAnInterruptedRun) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.txt.part") << "half of something longer";
  write_text(folder / "a.txt", "all");
  EXPECT_EQ(bytes_of(folder / "a.txt"), "all");
  EXPECT_THAT(names_in(folder.path()), ElementsAre("a.txt"));
}

TEST(WriteWhole, ReportsAMissingFolder) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of([&] { write_text(folder / "no/a.txt", "text"); }),
              AllOf(HasSubstr("no/a.txt: cannot be written: No such file or directory"),
                    HasSubstr("create its folder first")));
}

TEST(WriteWhole, ReportsAPathThroughAFile) {
  const TemporaryFolder folder;
  write_text(folder / "file", "text");
  EXPECT_THAT(message_of([&] { write_text(folder / "file/a.txt", "text"); }),
              AllOf(HasSubstr("file/a.txt: cannot be written: Not a directory"),
                    HasSubstr("a part of its path is a file")));
}

TEST(WriteWhole, ReportsATooLongName) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of([&] { write_text(folder / std::string(300, 'a'), "text"); }),
              AllOf(HasSubstr("File name too long"), HasSubstr("choose a shorter name")));
}

TEST(WriteWhole, RejectsFoldersAndDevices) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of([&] { write_text(folder.path(), "text"); }),
              HasSubstr("is a folder or a device"));
  EXPECT_THAT(message_of([&] { write_text("/dev/null", "text"); }),
              HasSubstr("is a folder or a device"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(WriteWhole, LeavesNoFileWhenTheFileSizeLimitIsExceeded) {
  const TemporaryFolder folder;
  const FileSizeLimit limit(10000);
  EXPECT_THAT(message_of([&] { write_text(folder / "a.txt", std::string(10001, 'a')); }),
              AllOf(HasSubstr("a.txt: cannot be written: File too large"), HasSubstr("ulimit -f")));
  EXPECT_THAT(names_in(folder.path()), IsEmpty());
  write_text(folder / "a.txt", std::string(10000, 'a'));
  EXPECT_EQ(fs::file_size(folder / "a.txt"), 10000u);
}

TEST(WriteWhole, LeavesNoFileOnAFullDisk) {
  const SmallDisk disk;
  if (disk.reason() != 0)
    GTEST_SKIP() << "no tmpfs can be mounted here: " << std::strerror(disk.reason());
  EXPECT_THAT(
      message_of([&] { write_text(fs::path(disk.path()) / "a.txt", std::string(100'000, 'a')); }),
      AllOf(HasSubstr("a.txt: cannot be written: No space left on device"),
            HasSubstr("free some space")));
  EXPECT_THAT(names_in(disk.path()), IsEmpty());
}

TEST(ReadText, ReturnsEveryByte) {
  const TemporaryFolder folder;
  std::string text;  // sizes around that of the read buffer
  for (const std::size_t size : {0, 1, 65535, 65536, 65537, 1'000'000}) {
    while (text.size() < size) text += static_cast<char>(text.size() * 7 % 256);
    write_text(folder / "a", text);
    EXPECT_EQ(read_text(folder / "a"), text);
  }
}

TEST(ReadText, ReportsWhyAFileCannotBeRead) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of([&] { read_text(folder / "a"); }),
              HasSubstr("a: there is no such file or folder"));
  EXPECT_THAT(message_of([&] { read_text(folder.path()); }),
              HasSubstr("it is a folder, but must be a file"));
}

TEST(CheckEnding, ComparesWithoutCaseAndNamesTheFirstEnding) {
  EXPECT_NO_THROW(check_ending("x.TIF", {".tif", ".tiff"}));
  EXPECT_EQ(message_of([] {
              check_ending("x.png", {".tif", ".tiff"});
            }),
            "x.png: its name must end in .tif");
}

}  // namespace
}  // namespace groundray::file_io_test
