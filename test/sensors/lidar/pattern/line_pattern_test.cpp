#include "sensors/lidar/pattern/line_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace groundray::line_pattern_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double pi = std::numbers::pi;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

PulseBatch sweep_of(const ScanPattern& scan, std::int64_t sweep) {
  PulseBatch batch;
  scan.fill(sweep, 0, scan.pulses(sweep), batch);
  return batch;
}

LinePattern ten_pulses(LinePattern::Mirror mirror) {
  LinePattern pattern;
  pattern.mirror = mirror;
  pattern.from_rad = -0.4;
  pattern.to_rad = 0.6;
  pattern.line_rate_hz = 50;
  pattern.pulse_rate_hz = 500;
  return pattern;
}

double elevation_rad(const glm::dvec3& d) { return std::atan2(d.z, std::hypot(d.x, d.y)); }

// An angle differs from its closed form by the rounding of a sum, a product, a sine and an
// arctangent.
constexpr double angle_tolerance = 8 * epsilon;

TEST(LinePattern, TriangleWaveMovesBothWaysAtAConstantRate) {
  const ScanPattern scan(ten_pulses(LinePattern::Mirror::Triangle));
  for (std::int64_t line = 0; line < 4; ++line) {
    const PulseBatch batch = sweep_of(scan, line);
    ASSERT_EQ(batch.size(), 10u);
    for (int i = 0; i < 10; ++i) {
      const double expected = line % 2 == 0 ? -0.4 + 0.1 * i : 0.6 - 0.1 * i;
      const auto row = static_cast<std::size_t>(i);
      EXPECT_NEAR(elevation_rad(batch.direction[row]), expected, angle_tolerance);
      EXPECT_NEAR(batch.volleys[row].time_s, static_cast<double>(line) / 50 + i / 500., 1e-15);
    }
  }
}

TEST(LinePattern, SineWaveIsSlowestAtItsEnds) {
  const ScanPattern scan(ten_pulses(LinePattern::Mirror::Sine));
  // 1, cos 18, cos 36, ... degrees, from tables.
  const double cosines[] = {
      1, 0.95105651629515,  0.80901699437495,  0.58778525229247,  0.30901699437495,
      0, -0.30901699437495, -0.58778525229247, -0.80901699437495, -0.95105651629515};
  for (const std::int64_t line : {0, 1, 6}) {
    const PulseBatch batch = sweep_of(scan, line);
    for (std::size_t i = 0; i < 10; ++i) {
      const double swing = (line % 2 == 0 ? -0.5 : 0.5) * cosines[i];
      EXPECT_NEAR(elevation_rad(batch.direction[i]), 0.1 + swing,
                  1e-14);  // precision of the tables
    }
  }
}

// A mirror of 4 facets that turns 12.5 times a second makes 50 lines of pi rad of scan angle: twice
// its own quarter turn. From one pulse to the next the beam turns by 4 pi 12.5 Hz / rate.
TEST(LinePattern, PolygonMirrorSweepsTwiceItsOwnAngle) {
  LinePattern pattern = ten_pulses(LinePattern::Mirror::Polygon);
  pattern.facets = 4;
  pattern.from_rad = -pi / 4;
  pattern.to_rad = pi / 4;
  pattern.pulse_rate_hz = 4000;  // 2.25 degrees
  const ScanPattern scan(pattern);
  for (const std::int64_t line : {0, 1, 2, 1001}) {
    const PulseBatch batch = sweep_of(scan, line);
    ASSERT_EQ(batch.size(), 41u);  // 90 / 2.25 and one more
    for (std::size_t i = 0; i < 41; ++i) {
      EXPECT_NEAR(elevation_rad(batch.direction[i]), (static_cast<double>(i) - 20) * pi / 80,
                  4 * angle_tolerance);
      // The centre of the field of view is the middle of the line's time.
      const double time_s = (static_cast<double>(line) + 0.5) / 50;
      EXPECT_NEAR(batch.volleys[i].time_s, time_s + (static_cast<double>(i) - 20) / 4000,
                  4 * epsilon * time_s);
    }
  }
}

TEST(LinePattern, PulsesNeverExceedTheLasersRate) {
  for (const auto mirror : {LinePattern::Mirror::Triangle, LinePattern::Mirror::Polygon}) {
    LinePattern pattern = ten_pulses(mirror);
    pattern.facets = mirror == LinePattern::Mirror::Polygon ? 3 : 0;
    pattern.pulse_rate_hz = 777;
    pattern.lines_per_sweep = 20;
    const PulseBatch batch = sweep_of(ScanPattern(pattern), 3);
    for (std::size_t i = 1; i < batch.volleys.size(); ++i) {
      EXPECT_GE(batch.volleys[i].time_s - batch.volleys[i - 1].time_s, (1 - 1e-12) / 777);
    }
  }
}

// The head turns by 2 pi rate t, so each pulse lies on the meridian of that azimuth.
TEST(LinePattern, VerticalLinesAreMeridiansOfATurningHead) {
  LinePattern pattern = ten_pulses(LinePattern::Mirror::Triangle);
  pattern.head_rate_hz = -0.125;
  pattern.head_start_rad = 0.25;
  pattern.lines_per_sweep = 400;  // one turn
  const ScanPattern scan(pattern);
  EXPECT_DOUBLE_EQ(scan.sweep_rate_hz(), 0.125);
  EXPECT_EQ(scan.pulses(0), 4000);
  const PulseBatch batch = sweep_of(scan, 2);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const double azimuth = 0.25 - 2 * pi * 0.125 * batch.volleys[i].time_s;
    const glm::dvec3& d = batch.direction[i];
    EXPECT_NEAR(std::remainder(std::atan2(d.y, d.x) - azimuth, 2 * pi), 0, 1e-14);  // 4 turns
    EXPECT_NEAR(glm::dot(batch.horizontal[i], {-std::sin(azimuth), std::cos(azimuth), 0}), 1,
                1e-14);
  }
}

TEST(LinePattern, AcrossLinesMeasureAnglesFromNadirToTheLeft) {
  LinePattern pattern = ten_pulses(LinePattern::Mirror::Triangle);
  pattern.plane = LinePattern::Plane::Across;
  const PulseBatch batch = sweep_of(ScanPattern(pattern), 0);
  for (std::size_t i = 0; i < 10; ++i) {
    const glm::dvec3& d = batch.direction[i];
    EXPECT_EQ(d.x, 0);
    EXPECT_NEAR(std::atan2(d.y, -d.z), -0.4 + 0.1 * static_cast<double>(i), angle_tolerance);
    EXPECT_NEAR(glm::dot(d, batch.horizontal[i]), 0, epsilon);
    EXPECT_GT(batch.horizontal[i].y, 0);
  }
}

TEST(LinePattern, RejectsAPatternWithEveryFaultInOneError) {
  LinePattern pattern;
  pattern.from_rad = 30;
  pattern.to_rad = 30;
  pattern.facets = 4;
  pattern.lines_per_sweep = 0;
  pattern.head_rate_hz = NAN;
  EXPECT_THAT(
      [&] { ScanPattern{pattern}; },
      ThrowsMessage<Error>(AllOf(
          HasSubstr("line_rate_hz = 0"), HasSubstr("pulse_rate_hz = 0"),
          HasSubstr("scan angle 30 must be in [-2 pi, 2 pi]: is it in degrees?"),
          HasSubstr("the line is empty"), HasSubstr("facets = 4 applies to polygon mirrors only"),
          HasSubstr("lines_per_sweep = 0"), HasSubstr("head_rate_hz = nan"))));
}

TEST(LinePattern, RejectsAFieldOfViewWiderThanAFacet) {
  LinePattern pattern = ten_pulses(LinePattern::Mirror::Polygon);
  pattern.facets = 16;  // 4 pi / 16 = 0.785 rad
  EXPECT_THAT(
      [&] { ScanPattern{pattern}; },
      ThrowsMessage<Error>(HasSubstr("one of 16 facets sweeps 0.785398 rad, less than the 1 "
                                     "rad")));
}

}  // namespace
}  // namespace groundray::line_pattern_test
