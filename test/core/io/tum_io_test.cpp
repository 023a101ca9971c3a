#include "core/io/tum_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <chrono>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <locale>
#include <random>

#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::tum_io_test {
namespace {

namespace fs = std::filesystem;
using std::chrono::nanoseconds;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::TemporaryFolder;

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

std::int64_t time_of(const std::string& word) {
  return parse_tum(word + " 0 0 0 0 0 0 1\n", "t").begin_time().count();
}

TEST(Tum, TimesAreExactDecimals) {
  EXPECT_EQ(time_of("1600000000.123456789"), 1'600'000'000'123'456'789);
  EXPECT_EQ(time_of("1.600000000123456789e+09"), 1'600'000'000'123'456'789);
  EXPECT_EQ(time_of("16000000001234567890E-10"), 1'600'000'000'123'456'789);
  EXPECT_EQ(time_of("0.000000001"), 1);
  EXPECT_EQ(time_of("-0.5"), -500'000'000);
  EXPECT_EQ(time_of("+3."), 3'000'000'000);
  EXPECT_EQ(time_of(".25"), 250'000'000);
  EXPECT_EQ(time_of("000000000000000000000000000007"), 7'000'000'000);
  EXPECT_EQ(time_of("0e999"), 0);
  EXPECT_EQ(time_of("0.1234567894"), 123'456'789);
  EXPECT_EQ(time_of("0.1234567895"), 123'456'790);
  EXPECT_EQ(time_of("9e-10"), 1);
  EXPECT_EQ(time_of("4e-10"), 0);
  EXPECT_EQ(time_of("9e-30000"), 0);
  EXPECT_EQ(time_of("4600000000"), 4'600'000'000'000'000'000);
}

TEST(Tum, RejectsMalformedAndTooLargeTimes) {
  for (const char* word :
       {"4.7e9", "-4.7e9", "1403636579758555392", "1e30", "1e99999", "18446744073.709551617", "nan",
        "inf", "1e", "e5", ".", "-", "--1", "+-1", "1.2.3", "0x10", "1,5", "1s"}) {
    EXPECT_THAT(message_of([&] { time_of(word); }),
                HasSubstr(std::string("t:1: t = \"") + word + "\" must be"));
  }
}

Trajectory winding_path() {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<Trajectory::Sample> samples;
  nanoseconds time(-5'000'000'001);
  for (int i = 0; i < 1000; ++i) {
    const glm::dquat rotation(normal(random), normal(random), normal(random), normal(random));
    const glm::dvec3 position(normal(random) * 1e7, normal(random), normal(random) * 1e-300);
    samples.push_back({time, {glm::normalize(rotation), position}});
    time += nanoseconds(1 + static_cast<std::int64_t>(random() % 20'000'000));
  }
  samples.push_back({nanoseconds(1'600'000'000'123'456'789), {}});
  return Trajectory(std::move(samples));
}

TEST(Tum, ReadsBackWrittenTrajectories) {
  const TemporaryFolder folder;
  const Trajectory written = winding_path();
  write_tum(folder / "a.tum", written, "X_WS\nseconds metres");
  EXPECT_THAT(bytes_of(folder / "a.tum"),
              ::testing::StartsWith("# X_WS\n# seconds metres\n-5.000000001 "));
  const Trajectory read = read_tum(folder / "a.tum");
  ASSERT_EQ(read.samples().size(), written.samples().size());
  for (std::size_t i = 0; i < read.samples().size(); ++i) {
    const auto& [time, pose] = written.samples()[i];
    EXPECT_EQ(read.samples()[i].time, time);
    EXPECT_EQ(read.samples()[i].pose.translation_m, pose.translation_m);
    // The norm is set to 1 twice: each time the norm and a quotient are rounded.
    constexpr double tolerance = 4 * std::numeric_limits<double>::epsilon();
    EXPECT_LE(glm::length(read.samples()[i].pose.rotation - pose.rotation), tolerance);
  }
}

TEST(Tum, ReadsCommentsBlankLinesAndCarriageReturns) {
  const Trajectory path = parse_tum(
      "# t x y z qx qy qz qw\r\n\r\n  # more\n 1 2\t3 4 0 0 0 1 \r\n\n2 5 6 7 1 0 0 0", "t");
  ASSERT_EQ(path.samples().size(), 2u);
  EXPECT_EQ(path.samples()[0].pose, (Pose{{1, 0, 0, 0}, {2, 3, 4}}));
  EXPECT_EQ(path.samples()[1].pose, (Pose{{0, 1, 0, 0}, {5, 6, 7}}));
}

TEST(Tum, AcceptsQuaternionsOfFourDecimals) {
  const Trajectory path =
      parse_tum("1305031098.6659 1.3563 0.6305 1.6380 0.6132 0.5962 -0.3311 -0.3986", "fr1_xyz");
  EXPECT_NEAR(glm::length(path.samples()[0].pose.rotation), 1, 1e-15);
}

TEST(Tum, ReportsEveryBadLineAndItsRule) {
  const char* const text =
      "0 0 0 0 0 0 0 1\n"
      "1 0 0 0 0 0 1\n"
      "2 0 nan 0 0 0 0 1\n"
      "3 0 0 inf 0 0 0 1\n"
      "4 0 0 0 0 0 0 x1\x1b\n"
      "5 0 0 0 0 0 0 1.1\n"
      "6 0 0 0 0 0 0 1\n"
      "6 0 0 0 0 0 0 1\n"
      "5.999999999 0 0 0 0 0 0 1\n"
      "7 0 0 0 0 0 0 1 9\n"
      "8 0 0 1e999 0 0 0 1\n";
  EXPECT_EQ(message_of([&] { parse_tum(text, "a.tum"); }),
            "a.tum:2: the line has 7 values; it must have 8: t x y z qx qy qz qw\n"
            "a.tum:3: y = \"nan\" must be a finite number\n"
            "a.tum:4: z = \"inf\" must be a finite number\n"
            "a.tum:5: qw = \"x1\\x1b\" must be a finite number\n"
            "a.tum:6: the quaternion qx qy qz qw has norm 1.1; it must be 1: is qw the last of the "
            "four?\n"
            "a.tum:8: t = 6.000000000 s is not later than the 6.000000000 s of a line above; "
            "times must increase\n"
            "a.tum:9: t = 5.999999999 s is not later than the 6.000000000 s of a line above; "
            "times must increase\n"
            "a.tum:10: the line has 9 values; it must have 8: t x y z qx qy qz qw\n"
            "a.tum:11: z = \"1e999\" must be a finite number");
}

TEST(Tum, KeepsTheMessageShortForAnotherFormat) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "v 0 0 0\n";
  EXPECT_THAT(message_of([&] { parse_tum(text, "a.obj"); }),
              AllOf(HasSubstr("a.obj:100: the line has 4 values"), Not(HasSubstr("a.obj:101")),
                    HasSubstr("\nand 900 more")));
}

TEST(Tum, ReportsAFileWithoutPoses) {
  EXPECT_THAT(message_of([] { parse_tum("# nothing\n", "a.tum"); }),
              HasSubstr("a.tum: it contains no pose"));
}

struct Comma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(Tum, DoesNotDependOnTheLocale) {
  const TemporaryFolder folder;
  const Trajectory path = parse_tum("12345.5 1234.5 0 0 0 0 0 1", "t");
  const std::locale before = std::locale::global(std::locale(std::locale(), new Comma));
  write_tum(folder / "a.tum", path, "");
  const Trajectory read = read_tum(folder / "a.tum");
  std::locale::global(before);
  EXPECT_EQ(bytes_of(folder / "a.tum"), "12345.500000000 1234.5 0 0 0 0 0 1\n");
  EXPECT_EQ(read.samples()[0].pose, path.samples()[0].pose);
}

}  // namespace
}  // namespace groundray::tum_io_test
