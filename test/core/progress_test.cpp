#include "core/progress.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>

namespace groundray::progress_test {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

std::string text_of(std::FILE* file) {
  std::string text(static_cast<std::size_t>(std::ftell(file)), '\0');
  EXPECT_EQ(std::fseek(file, 0, SEEK_SET), 0);
  EXPECT_EQ(std::fread(text.data(), 1, text.size(), file), text.size());
  return text;
}

/// A terminal that records its output.
class Terminal {
 public:
  Terminal() : screen_(posix_openpt(O_RDWR | O_NOCTTY)) {
    if (screen_ >= 0 && grantpt(screen_) == 0 && unlockpt(screen_) == 0) {
      file_.reset(std::fopen(ptsname(screen_), "w"));
    }
  }
  ~Terminal() { close(screen_); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  std::FILE* file() const { return file_.get(); }
  /// Everything written so far; the kernel may deliver it in pieces, a little later.
  std::string text() const {
    std::string text;
    std::array<char, 4096> piece;
    pollfd ready{screen_, POLLIN, 0};
    while (poll(&ready, 1, 200) > 0) {
      const ssize_t size = read(screen_, piece.data(), piece.size());
      if (size <= 0) break;
      text.append(piece.data(), static_cast<std::size_t>(size));
    }
    return text;
  }

 private:
  int screen_;
  File file_;
};

void work(Progress& progress, std::chrono::milliseconds duration) {
  const auto end = std::chrono::steady_clock::now() + duration;
  while (std::chrono::steady_clock::now() < end) progress.update(3);
}

TEST(Progress, WritesOnlyTheFinalLineOfShortWorkToAFile) {
  const File file(std::tmpfile());
  {
    Progress progress(file.get(), "scans", 10);
    for (std::uint64_t done = 1; done <= 10; ++done) progress.update(done);
    progress.update(10);
  }
  EXPECT_EQ(text_of(file.get()), "scans 10/10 in 0.0 s\n");
}

TEST(Progress, IsSilentWithoutAStream) {
  Progress progress(nullptr, "scans", 1);
  progress.update(1);
}

TEST(Progress, RedrawsATerminalAtMostTenTimesASecond) {
  const Terminal terminal;
  if (terminal.file() == nullptr) GTEST_SKIP() << "there are no pseudo terminals here";
  {
    Progress progress(terminal.file(), "scans", 10);
    work(progress, 550ms);
    progress.update(10);
  }
  const std::string text = terminal.text();
  EXPECT_THAT(text, AllOf(StartsWith("\rscans 0/10\r"), HasSubstr("/s, "), HasSubstr(" s left")));
  EXPECT_THAT(text, MatchesRegex(".*\rscans 10/10 in 0\\.[0-9] s *\r\n"));
  EXPECT_EQ(std::ranges::count(text, '\n'), 1);
  std::size_t lines = 0;
  for (std::size_t at = text.find("\rscans"); at != std::string::npos;
       at = text.find("\rscans", at + 1))
    ++lines;
  EXPECT_GE(lines, 3u);
  EXPECT_LE(lines, 1u + 5u + 1u);  // the first, one per 100 ms, the last
}

TEST(Progress, PadsAShorterLineWithBlanks) {
  const Terminal terminal;
  if (terminal.file() == nullptr) GTEST_SKIP() << "there are no pseudo terminals here";
  {
    Progress progress(terminal.file(), "scans", 10);
    work(progress, 150ms);
    progress.update(10);
  }
  const std::string text = terminal.text();
  const std::size_t last = text.rfind("\rscans");
  const std::size_t before = text.rfind("\rscans", last - 1);
  EXPECT_EQ(text.size() - last - 2, last - before);  // except for the line end, CR LF
}

TEST(Progress, EndsTheLineOfWorkThatStopsEarly) {
  const Terminal terminal;
  if (terminal.file() == nullptr) GTEST_SKIP() << "there are no pseudo terminals here";
  { const Progress progress(terminal.file(), "scans", 10); }
  EXPECT_EQ(terminal.text(), "\rscans 0/10\r\n");
}

TEST(Progress, SurvivesAFullDisk) {
  const File file(std::fopen("/dev/full", "w"));
  ASSERT_NE(file, nullptr);
  Progress progress(file.get(), "scans", 1);
  EXPECT_NO_THROW(progress.update(1));
}

TEST(DurationText, UsesReadableUnits) {
  EXPECT_EQ(duration_text(0s), "0.0 s");
  EXPECT_EQ(duration_text(400ms), "0.4 s");
  EXPECT_EQ(duration_text(949ms), "0.9 s");
  EXPECT_EQ(duration_text(950ms), "1 s");
  EXPECT_EQ(duration_text(3.3s), "3 s");
  EXPECT_EQ(duration_text(12s), "12 s");
  EXPECT_EQ(duration_text(59.4s), "59 s");
  EXPECT_EQ(duration_text(59.6s), "1 min 0 s");
  EXPECT_EQ(duration_text(200s), "3 min 20 s");
  EXPECT_EQ(duration_text(3599.6s), "1 h 0 min");
  EXPECT_EQ(duration_text(7500s), "2 h 5 min");
  EXPECT_EQ(duration_text(50h), "50 h 0 min");
}

}  // namespace
}  // namespace groundray::progress_test
