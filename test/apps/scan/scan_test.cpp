#include "apps/scan/scan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "apps/scan/column_names.h"
#include "core/error.h"
#include "test/support/scans/sample_scan.h"

namespace groundray::scan_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

template <typename F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "no Error was thrown";
}

/// A cloud with one point (3, 4, 0) and one more column of type T.
template <typename T>
CloudFile one_point(const std::string& name, T value) {
  CloudFile file{.form = "made up", .cloud = PointCloud(1)};
  file.cloud.add<float>("x")[0] = 3;
  file.cloud.add<float>("y")[0] = 4;
  file.cloud.add<float>("z")[0] = 0;
  file.cloud.add<T>(name)[0] = value;
  return file;
}

TEST(ColumnNames, RecognisesCommonSpellings) {
  const auto found = [](const std::vector<std::string>& columns, const char* ours) {
    const auto column = find_column(columns, ours);
    return column ? column->name : "none";
  };
  EXPECT_EQ(found({"Position_X"}, "x"), "Position_X");
  EXPECT_EQ(found({"Points:0", "x"}, "x"), "x");
  EXPECT_EQ(found({"Points:0"}, "x"), "Points:0");
  EXPECT_EQ(found({"Scalar_Intensity"}, "intensity"), "Scalar_Intensity");
  EXPECT_EQ(found({"reflectivity", "Intensity"}, "intensity"), "Intensity");
  EXPECT_EQ(found({"laser_id"}, "ring"), "laser_id");
  EXPECT_EQ(found({"channel"}, "ring"), "channel");
  EXPECT_EQ(found({"return_number"}, "return_index"), "return_number");
  EXPECT_EQ(found({"Classification"}, "label"), "Classification");
  EXPECT_EQ(found({"r"}, "range"), "r");
  EXPECT_EQ(found({"r", "g", "b"}, "range"), "none");  // r is red
  EXPECT_EQ(found({"range_true"}, "range"), "none");
  EXPECT_EQ(found({"world_x", "nx"}, "x"), "none");
  EXPECT_EQ(found({"x"}, "no such name"), "none");
  EXPECT_EQ(found({"Measurement_ID", "col"}, "column"), "col");
  EXPECT_EQ(found({"measurement_id"}, "column"), "measurement_id");
  EXPECT_EQ(found({"range", "range_sd"}, "range_sd"), "range_sd");
  EXPECT_EQ(found({"range_sd"}, "range"), "none");
}

TEST(ColumnNames, SuffixSetsTheUnitOfTime) {
  EXPECT_EQ(find_column({"t_ns"}, "time")->unit_s, 1e-9);
  EXPECT_EQ(find_column({"time_offset_us"}, "time")->unit_s, 1e-6);
  EXPECT_EQ(find_column({"time_s"}, "time")->unit_s, 1);
  EXPECT_EQ(find_column({"time_stamp"}, "time")->unit_s, std::nullopt);
}

TEST(Scan, ReadsColumnsOfReturnsOnly) {
  CloudFile file{.form = "made up", .cloud = PointCloud(3), .image = {1, 3}};
  const float x[] = {1, 0, 2}, sd[] = {0.01f, 0.02f, 0.03f};
  const std::uint16_t columns[] = {7, 8, 9};
  std::ranges::copy(x, file.cloud.add<float>("x").begin());
  for (const char* name : {"y", "z"}) std::ranges::fill(file.cloud.add<float>(name), 0.f);
  std::ranges::copy(columns, file.cloud.add<std::uint16_t>("column").begin());
  std::ranges::copy(sd, file.cloud.add<float>("range_sd").begin());
  const Scan scan = scan_of(file, "sample", {});
  EXPECT_THAT(scan.row, ElementsAre(0, 2));
  EXPECT_THAT(*scan.find(Quantity::Column), ElementsAre(7, 9));
  EXPECT_THAT(*scan.find(Quantity::RangeSd), ElementsAre(0.01f, 0.03f));
  EXPECT_EQ(scan.image.columns, 3);
}

TEST(Scan, ClassifiesRowsWithoutReturns) {
  const double x[] = {1, 0, nan, infinity, -infinity, 1, 1, 1, -0.};
  const double y[] = {2, 0, 0, 0, -infinity, 1, 1, 1, 0};
  const double range[] = {1, 0, 1, 1, 1, infinity, -infinity, nan, 0};
  CloudFile file{.form = "made up", .cloud = PointCloud(9)};
  std::ranges::copy(x, file.cloud.add<double>("x").begin());
  std::ranges::copy(y, file.cloud.add<double>("y").begin());
  std::ranges::copy(y, file.cloud.add<double>("z").begin());
  std::ranges::copy(range, file.cloud.add<double>("range").begin());
  const Scan scan = scan_of(file, "a", {});
  EXPECT_EQ(scan.rows, 9u);
  EXPECT_THAT(scan.row, ElementsAre(0u));
  EXPECT_THAT(scan.p_S, ElementsAre(glm::dvec3(1, 2, 2)));
  EXPECT_THAT(*scan.find(Quantity::Range), ElementsAre(1));
  EXPECT_EQ(scan.no_returns.beyond, 2u);
  EXPECT_EQ(scan.no_returns.near, 2u);
  EXPECT_EQ(scan.no_returns.invalid, 2u);
  EXPECT_EQ(scan.no_returns.zero, 2u);
}

TEST(Scan, TransformsPointsToTheSensorFrameInMetres) {
  CloudFile file = one_point("i", std::uint8_t{7});
  ScanReading reading{.unit_m = 0.5};
  // The sensor looks along the file's y axis from (1, 0, 0) m: its x axis is the file's y axis.
  reading.X_FS = Pose{.rotation = glm::dquat(std::sqrt(0.5), 0, 0, std::sqrt(0.5)),
                      .translation_m = {1, 0, 0}};
  const Scan scan = scan_of(file, "a", reading);  // (1.5, 2, 0) m - (1, 0, 0) m
  EXPECT_NEAR(glm::distance(scan.p_S[0], glm::dvec3(2, -0.5, 0)), 0, 1e-15);
  EXPECT_THAT(*scan.find(Quantity::Intensity), ElementsAre(7));
  reading.X_FS = FileViewpoint{};
  EXPECT_THAT(message_of([&] { scan_of(file, "a", reading); }),
              AllOf(HasSubstr("only PCD files contain a viewpoint"), HasSubstr("(--sensor-pose)")));
  file.X_FS = Pose{.translation_m = {1, 0, 0}};  // in the file's unit
  EXPECT_EQ(scan_of(file, "a", reading).p_S[0], glm::dvec3(1, 2, 0));
  EXPECT_THAT(scan_of(file, "a", {}).notes[0],
              AllOf(HasSubstr("VIEWPOINT other than the origin"), HasSubstr("(--viewpoint;")));
}

TEST(Scan, AppliesTheUnitOfTime) {
  const auto time_of = [](const CloudFile& file, const ScanReading& reading) {
    return scan_of(file, "a", reading).find(Quantity::Time)->at(0);
  };
  EXPECT_EQ(time_of(one_point("t", 0.25), {}), 0.25);  // floating-point numbers are seconds
  EXPECT_EQ(time_of(one_point("t_ns", 2.5e8), {}), 0.25);
  EXPECT_EQ(time_of(one_point("t", std::uint32_t{250'000'000}), {.time_unit_s = 1e-9}), 0.25);
  EXPECT_EQ(time_of(one_point("t", 10.25), {.time_zero = std::chrono::seconds(10)}), 0.25);
  EXPECT_NEAR(time_of(one_point("t", 8.),
                      {.time_unit_s = 0.4e-9, .time_zero = std::chrono::nanoseconds(2)}),
              1.2e-9, 1e-23);
  const Scan asked = scan_of(one_point("t", std::uint32_t{5}), "a", {});
  EXPECT_EQ(asked.find(Quantity::Time), nullptr);
  EXPECT_THAT(asked.notes, ElementsAre(AllOf(HasSubstr("The unit of column t of a is unknown"),
                                             HasSubstr("give it (--time-unit-s 1e-9"))));
  EXPECT_THAT(asked.frame, HasSubstr("taken as in the sensor's frame"));
  EXPECT_THAT(asked.unused, ElementsAre("t"));
}

// At this magnitude, neighbouring doubles are 256 ns apart.
TEST(Scan, KeepsNanosecondsOfUnixTimes) {
  CloudFile file = one_point("timestamp_ns", 22.);
  file.origins = {{"timestamp_ns", 1'673'400'471'837'873'200}};
  ScanReading reading{.time_zero = std::chrono::nanoseconds(1'673'400'471'837'873'197)};
  EXPECT_DOUBLE_EQ(scan_of(file, "a", reading).find(Quantity::Time)->at(0), 25e-9);
  file.origins[0].origin /= 1000;
  reading.time_unit_s = 1e-6;  // 22 us after ...873 us; time zero is at ...873.197 us
  EXPECT_DOUBLE_EQ(scan_of(file, "a", reading).find(Quantity::Time)->at(0), 21.803e-6);
}

TEST(Scan, IgnoresTimesOfImplausibleDuration) {
  CloudFile file{.form = "made up", .cloud = PointCloud(2)};
  for (const char* name : {"x", "y", "z"}) std::ranges::fill(file.cloud.add<float>(name), 1.f);
  std::ranges::copy(std::array{1.6e18, 1.6e18 + 1e8}, file.cloud.add<double>("timestamp").begin());
  const Scan scan = scan_of(file, "a", {});
  EXPECT_EQ(scan.find(Quantity::Time), nullptr);
  EXPECT_THAT(scan.notes[0], HasSubstr("the scan would last 1e+08 s"));
}

TEST(Scan, CountsReturnsFromOne) {
  const auto index_of = [](std::uint8_t value) {
    return scan_of(one_point("return_number", value), "a", {}).find(Quantity::ReturnIndex)->at(0);
  };
  EXPECT_EQ(index_of(1), 1);
  EXPECT_EQ(index_of(0), 1);
}

TEST(Scan, IgnoresColumnsWithNonFiniteValues) {
  const Scan scan = scan_of(one_point("ring", nan), "a", {});
  EXPECT_EQ(scan.find(Quantity::Ring), nullptr);
  EXPECT_THAT(scan.notes.back(), HasSubstr("1 values of ring are not finite"));
}

TEST(Scan, ReportsTheMeaningOfEachColumn) {
  const Scan scan = scan_of(one_point("laser_id", std::uint8_t{3}), "a", {.unit_m = 0.001});
  ASSERT_EQ(scan.read.size(), 4u);
  EXPECT_EQ(scan.read[0].note, "of 0.001 m");
  EXPECT_EQ(scan.read[3].theirs, "laser_id");
  EXPECT_EQ(scan.read[3].ours, "ring");
  EXPECT_THAT(scan_of(one_point("curvature", 1.f), "a", {}).unused, ElementsAre("curvature"));
}

TEST(Scan, ReportsMissingColumns) {
  CloudFile file{.form = "made up", .cloud = PointCloud(1)};
  for (const char* name : {"x", "Y", "zz", "red"}) file.cloud.add<float>(name)[0] = 1;
  EXPECT_THAT(
      message_of([&] { scan_of(file, "a.ply", {}); }),
      HasSubstr("a.ply: it has no column for z; did you mean 'zz'?; it has: x, Y, zz, red"));
  EXPECT_THAT(message_of([&] { scan_of(file, "a.ply", {.unit_m = 0, .time_unit_s = -1}); }),
              AllOf(HasSubstr("its unit, 0 m, must be positive (--unit-m)"),
                    HasSubstr("its unit of time, -1 s, must be positive (--time-unit-s)")));
}

}  // namespace
}  // namespace groundray::scan_test
