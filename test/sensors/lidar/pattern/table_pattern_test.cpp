#include "sensors/lidar/pattern/table_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace groundray::table_pattern_test {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double degree = std::numbers::pi / 180;

PulseBatch sweep_of(const ScanPattern& scan, std::int64_t sweep) {
  PulseBatch batch;
  scan.fill(sweep, 0, scan.pulses(sweep), batch);
  return batch;
}

constexpr const char* small_table =
    "# made by hand\n"
    "time_s,azimuth_deg,elevation_deg,channel\n"
    "0,0,0,0\r\n"
    "0, 90, 0, 1\n"
    "\n"
    "0.25,-90,30,2\n"
    "0.5,180,-30,65535\n";

TEST(TablePattern, ReadsTheRowsOfACsv) {
  const TablePattern table = parse_table(small_table, "t.csv", 1);
  ASSERT_EQ(table.shots.size(), 4u);
  const PulseBatch batch = sweep_of(ScanPattern(table), 3);
  EXPECT_THAT(batch.ring, ElementsAre(0, 1, 2, 65535));
  ASSERT_EQ(batch.volleys.size(), 3u);
  EXPECT_EQ(batch.volleys[0].end, 2u);
  EXPECT_DOUBLE_EQ(batch.volleys[1].time_s, 3.25);
  const glm::dvec3 expected[] = {
      {1, 0, 0}, {0, 1, 0}, {0, -std::sqrt(0.75), 0.5}, {-std::sqrt(0.75), 0, -0.5}};
  const glm::dvec3 horizontal[] = {{0, 1, 0}, {-1, 0, 0}, {1, 0, 0}, {0, -1, 0}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LE(glm::distance(batch.direction[i], expected[i]), 2 * epsilon);
    EXPECT_LE(glm::distance(batch.horizontal[i], horizontal[i]), 2 * epsilon);
  }
}

TEST(TablePattern, ReadsColumnsInAnyOrderAndDefaultsChannelsToZero) {
  const TablePattern table = parse_table("elevation_deg,time_s,azimuth_deg\n10,0.5,20\n", "t", 1);
  EXPECT_DOUBLE_EQ(table.shots[0].elevation_rad, 10 * degree);
  EXPECT_DOUBLE_EQ(table.shots[0].azimuth_rad, 20 * degree);
  EXPECT_EQ(table.shots[0].time_s, 0.5);
  EXPECT_EQ(table.shots[0].ring, 0);
}

TEST(TablePattern, SplitsAPeriodIntoSweeps) {
  TablePattern table = parse_table(small_table, "t.csv", 0.75);
  table.sweeps_per_period = 3;
  const ScanPattern scan(table);
  EXPECT_DOUBLE_EQ(scan.sweep_rate_hz(), 4);
  for (std::int64_t sweep = 0; sweep < 9; ++sweep) {
    EXPECT_EQ(scan.pulses(sweep), sweep % 3 == 0 ? 2 : 1) << sweep;
    EXPECT_EQ(scan.stamp(sweep), sweep * 250ms);
    EXPECT_EQ(scan.last_firing(sweep), sweep * 250ms);
  }
  EXPECT_THAT(sweep_of(scan, 5).ring, ElementsAre(65535));
}

struct BadRow {
  const char* text;
  const char* message;
};

TEST(TablePattern, EachKindOfBadRowHasItsOwnMessage) {
  const BadRow rows[] = {
      {"0,0,0", "t.csv:2: it has 3 values, but must have 4, as the first line"},
      {"0,0,0,0,0", "t.csv:2: it has 5 values"},
      {"0,left,0,0", "t.csv:2: azimuth_deg = 'left' must be a finite number"},
      {"0,nan,0,0", "t.csv:2: azimuth_deg = 'nan' must be a finite number"},
      {"0,0,,0", "t.csv:2: elevation_deg = '' must be a finite number"},
      {"1,0,0,0", "t.csv:2: time_s = 1 must be in [0, 1), the period: is it in seconds?"},
      {"-1,0,0,0", "t.csv:2: time_s = -1 must be in [0, 1)"},
      {"0.5,0,0,0\n0.25,0,0,0", "t.csv:3: time_s = 0.25 is earlier than 0.5 in a line above"},
      {"0,0,91,0", "t.csv:2: elevation_deg = 91 must be from -90 to 90: is it a zenith angle?"},
      {"0,0,0,1.5", "t.csv:2: channel = 1.5 must be a whole number from 0 to 65535"},
      {"0,0,0,65536", "t.csv:2: channel = 65536 must be"},
  };
  for (const BadRow& row : rows) {
    const std::string text = std::string("time_s,azimuth_deg,elevation_deg,channel\n") + row.text;
    EXPECT_THAT([&] { parse_table(text, "t.csv", 1); },
                ThrowsMessage<Error>(HasSubstr(row.message)));
  }
}

TEST(TablePattern, ListsEveryBadRow) {
  EXPECT_THAT(
      [] { parse_table("time_s,azimuth_deg,elevation_deg\n0,x,0\n0,0,0\n2,0,0\n", "t.csv", 1); },
      ThrowsMessage<Error>(
          AllOf(HasSubstr("t.csv:2: azimuth_deg"), HasSubstr("\nt.csv:4: time_s"))));
}

TEST(TablePattern, RejectsAnInvalidHeader) {
  EXPECT_THAT([] { parse_table("time_s,azimuth_deg\n", "t.csv", 1); },
              ThrowsMessage<Error>(HasSubstr("t.csv:1: column 'elevation_deg' is missing")));
  EXPECT_THAT([] { parse_table("time_s,azimut_deg,elevation_deg\n", "t.csv", 1); },
              ThrowsMessage<Error>(HasSubstr("t.csv:1: column 'azimut_deg' is unknown")));
  EXPECT_THAT([] { parse_table("time_s,time_s\n", "t.csv", 1); },
              ThrowsMessage<Error>(HasSubstr("t.csv:1: column 'time_s' is repeated")));
  EXPECT_THAT([] { parse_table("", "t.csv", 1); },
              ThrowsMessage<Error>(HasSubstr("t.csv: it contains no pulse")));
}

TEST(TablePattern, RejectsATableWithEveryFaultInOneError) {
  TablePattern table;
  table.period_s = 1;
  table.sweeps_per_period = 0;
  table.shots = {{.time_s = 0.5}, {.time_s = 0.25, .elevation_rad = 45}, {.time_s = 1}};
  EXPECT_THAT([&] { ScanPattern{table}; },
              ThrowsMessage<Error>(AllOf(HasSubstr("sweeps_per_period = 0"),
                                         HasSubstr("shots[1].time_s = 0.25 is earlier"),
                                         HasSubstr("shots[1].elevation_rad = 45"),
                                         HasSubstr("shots[2].time_s = 1 must be in [0,"))));
  TablePattern sparse = parse_table(small_table, "t.csv", 1);
  sparse.sweeps_per_period = 4;
  EXPECT_THAT(
      [&] { ScanPattern{sparse}; },
      ThrowsMessage<Error>(HasSubstr("sweep 3 of 4 has no pulse: reduce sweeps_per_period")));
}

TEST(TablePattern, RasterFiresRowByRowAtTheGivenTimes) {
  PixelArray pixels{.rows = 3, .columns = 4};
  pixels.horizontal_view_rad = 40 * degree;
  pixels.vertical_view_rad = 30 * degree;
  const ScanPattern scan(raster_pattern(pixels, 1e-3, 1e-4, 0.01));
  ASSERT_EQ(scan.pulses(0), 12);
  const PulseBatch batch = sweep_of(scan, 7);
  for (std::size_t i = 0; i < 12; ++i) {
    const std::size_t ring = i / 4;
    const auto row = static_cast<double>(ring), column = static_cast<double>(i % 4);
    EXPECT_EQ(batch.ring[i], ring);
    EXPECT_NEAR(batch.volleys[i].time_s, 0.07 + 1e-3 * row + 1e-4 * column, 1e-16);
    const glm::dvec3& d = batch.direction[i];
    EXPECT_NEAR(std::atan2(d.y, d.x), (15 - 10 * column) * degree, 4 * epsilon);
    EXPECT_NEAR(std::asin(d.z), (10 - 10 * row) * degree, 4 * epsilon);
  }
}

// Pixels on a plane: y / x and z / x are evenly spaced, and span twice the tangent of half the
// field of view.
TEST(TablePattern, FlashFiresAllPixelsAtOnceThroughAPinhole) {
  PixelArray pixels{.rows = 5, .columns = 8, .spacing = PixelArray::Spacing::EqualTangents};
  pixels.horizontal_view_rad = 90 * degree;
  pixels.vertical_view_rad = 2 * std::atan(0.5);
  const ScanPattern scan(raster_pattern(pixels, 0, 0, 0.05));
  const PulseBatch batch = sweep_of(scan, 2);
  ASSERT_EQ(batch.size(), 40u);
  ASSERT_EQ(batch.volleys.size(), 1u);
  EXPECT_DOUBLE_EQ(batch.volleys[0].time_s, 0.1);
  for (std::size_t i = 0; i < 40; ++i) {
    const glm::dvec3& d = batch.direction[i];
    const auto row = i / 8, column = i % 8;
    EXPECT_NEAR(d.y / d.x, 0.875 - 0.25 * static_cast<double>(column), 8 * epsilon);
    EXPECT_NEAR(d.z / d.x, 0.4 - 0.2 * static_cast<double>(row), 8 * epsilon);
  }
}

TEST(TablePattern, RejectsARasterThatDoesNotFitItsFrame) {
  EXPECT_THAT([] { raster_pattern({.rows = 10, .columns = 0}, 1, 0, 5); },
              ThrowsMessage<Error>(
                  AllOf(HasSubstr("10 rows and 0 columns"),
                        HasSubstr("the last pixel fires at 9 s, but the frame lasts 5 s"))));
}

}  // namespace
}  // namespace groundray::table_pattern_test
