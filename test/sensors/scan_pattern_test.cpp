#include "sensors/scan_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "core/error.h"

namespace groundray {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double pi = std::numbers::pi;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

SpinningPattern one_beam(double rate_hz, double period_us) {
  return {.rate_hz = rate_hz, .firing_period_s = period_us / 1e6, .beams = {Beam{}}};
}

TEST(ScanPattern, FiresBeamsInOrderOfTimeAndKeepsTheTablesOrderAmongEquals) {
  SpinningPattern pattern{.firing_period_s = 50e-6};
  const double times_us[] = {20, 0, 10, 0, 20, 10, 0};
  for (std::uint16_t ring = 0; const double time_us : times_us) {
    pattern.beams.push_back({.firing_time_s = time_us / 1e6, .ring = ring++});
  }
  const ScanPattern scan(pattern);
  std::vector<std::uint16_t> rings;
  for (const auto& shot : scan.shots()) rings.push_back(shot.ring);
  EXPECT_THAT(rings, ::testing::ElementsAre(1, 3, 6, 2, 5, 0, 4));
}

TEST(ScanPattern, BeamsThatFireTogetherAreOneVolley) {
  SpinningPattern pattern{.firing_period_s = 50e-6};
  for (const double time_us : {20., 0., 10., 0., 20., 10., 0.}) {
    pattern.beams.push_back({.firing_time_s = time_us / 1e6});
  }
  const ScanPattern scan(pattern);
  ASSERT_EQ(scan.volleys().size(), 3u);
  int begin = 0;
  const int sizes[] = {3, 2, 2};
  for (int i = 0; i < 3; ++i) {
    const auto& volley = scan.volleys()[static_cast<std::size_t>(i)];
    EXPECT_EQ(volley.begin, begin);
    EXPECT_EQ(volley.end, begin += sizes[i]);
    EXPECT_DOUBLE_EQ(volley.firing_time_s, 10e-6 * i);
  }
}

TEST(ScanPattern, PointsBeamsUpByElevationAndLeftByAzimuthOffset) {
  SpinningPattern pattern = one_beam(10, 100);
  pattern.beams = {{.elevation_rad = pi / 6, .azimuth_offset_rad = pi / 2}};
  const glm::dvec3 direction = ScanPattern(pattern).shots()[0].direction;
  EXPECT_NEAR(direction.x, 0, 2 * epsilon);  // one rounding of each angle, sine and product
  EXPECT_NEAR(direction.y, std::sqrt(0.75), 2 * epsilon);
  EXPECT_NEAR(direction.z, 0.5, 2 * epsilon);
}

TEST(ScanPattern, TurnsOf1024EqualColumnsBeginAtEvery1024thSequence) {
  const ScanPattern scan(one_beam(10, 97.65625));
  for (const std::int64_t sweep : {0, 1, 2, 3, 7, 1000, 99'999, 1'000'000, 50'000'000}) {
    EXPECT_EQ(scan.first_sequence(sweep), 1024 * sweep);
  }
}

// Sequence k begins at k * 55 296 ns and a turn takes 1e8 ns: whole numbers, so no rounding in the
// oracle.
TEST(ScanPattern, SweepsBeginWithTheFirstSequenceOfTheirTurn) {
  const ScanPattern scan(one_beam(10, 55.296));
  for (std::int64_t sweep = 0; sweep < 20'000; ++sweep) {
    const std::int64_t turn_ns = sweep * 100'000'000;
    ASSERT_EQ(scan.first_sequence(sweep), (turn_ns + 55'295) / 55'296) << "sweep " << sweep;
  }
}

TEST(ScanPattern, OneSequenceMayFillATurn) {
  const ScanPattern scan(one_beam(10, 100'000));
  EXPECT_EQ(scan.first_sequence(5), 5);
  EXPECT_EQ(scan.stamp(5), 500ms);
}

TEST(ScanPattern, StampsAreTheFirstAndLastFiringsToTheNanosecond) {
  SpinningPattern pattern = one_beam(10, 55.296);
  pattern.beams = {{.firing_time_s = 34.56e-6}, {.firing_time_s = 2.304e-6}};
  const ScanPattern scan(pattern);
  EXPECT_EQ(scan.stamp(0), 2304ns);
  EXPECT_EQ(scan.last_firing(0), 1808 * 55'296ns + 34'560ns);  // ceil(1e8 / 55296) = 1809 sequences
  EXPECT_EQ(scan.stamp(1), 1809 * 55'296ns + 2304ns);
  const std::int64_t day = 864'000;  // turns
  EXPECT_EQ(scan.stamp(day), (day * 100'000'000 + 55'295) / 55'296 * 55'296ns + 2304ns);
}

TEST(ScanPattern, ClockwiseHeadsTurnFromForwardToTheRight) {
  SpinningPattern pattern = one_beam(10, 100);
  EXPECT_DOUBLE_EQ(ScanPattern(pattern).spin_rad(0.025), 1.5 * pi);
  pattern.sense = SpinningPattern::Sense::CounterClockwise;
  EXPECT_DOUBLE_EQ(ScanPattern(pattern).spin_rad(0.025), 0.5 * pi);
  pattern.start_azimuth_rad = -pi;
  EXPECT_DOUBLE_EQ(ScanPattern(pattern).spin_rad(0.025), 1.5 * pi);
}

// Rate and time are binary fractions, so their product is a whole number over 2^30, known without
// rounding. It has more bits than a double: rounded, it would be up to 6e-9 rad off after 10^6 s.
TEST(ScanPattern, SpinStaysAccurateAfterDays) {
  constexpr double tolerance =
      4 * pi * epsilon;  // one rounding of the fraction and one of the angle
  SpinningPattern pattern = one_beam(10211. / 1024, 100);
  pattern.sense = SpinningPattern::Sense::CounterClockwise;
  const ScanPattern scan(pattern);
  std::mt19937_64 random(7);
  for (int i = 0; i < 100'000; ++i) {
    const std::uint64_t time = random() >> 24;  // in 2^-20 s
    const std::uint64_t fraction = 10211 * time % (1u << 30);
    const double expected = 2 * pi * std::ldexp(static_cast<double>(fraction), -30);
    const double spin = scan.spin_rad(std::ldexp(static_cast<double>(time), -20));
    ASSERT_LE(std::abs(std::remainder(spin - expected, 2 * pi)), tolerance) << time;
  }
}

TEST(ScanPattern, SpinIsNeverAWholeTurn) {
  const ScanPattern scan(one_beam(10, 100));
  for (const double time_s :
       {0., 1e-300, 1e-20, 1e-17, 0.1, std::nextafter(0.1, 0), std::nextafter(0.1, 1)}) {
    EXPECT_GE(scan.spin_rad(time_s), 0) << time_s;
    EXPECT_LT(scan.spin_rad(time_s), 2 * pi) << time_s;
  }
}

TEST(ScanPattern, RefusesAPatternWithEveryFaultInOneError) {
  SpinningPattern pattern = one_beam(0, 55.296);
  pattern.start_azimuth_rad = std::numeric_limits<double>::infinity();
  pattern.beams = {{.elevation_rad = 15},
                   {.azimuth_offset_rad = NAN},
                   {.origin_m = {0, NAN, 0}},
                   {.firing_time_s = -1e-6},
                   {.firing_time_s = 55.296e-6}};
  EXPECT_THAT(
      [&] { ScanPattern{pattern}; },
      ThrowsMessage<Error>(AllOf(
          HasSubstr("rate_hz = 0 must be positive"),
          HasSubstr("start_azimuth_rad = inf must be finite"),
          HasSubstr("beams[0].elevation_rad = 15 must be in [-pi/2, pi/2]: is it in degrees?"),
          HasSubstr("beams[1].azimuth_offset_rad"), HasSubstr("beams[2].origin_m"),
          HasSubstr("beams[3].firing_time_s"), HasSubstr("beams[4].firing_time_s"))));
}

TEST(ScanPattern, RefusesAPeriodThatIsNotInSeconds) {
  SpinningPattern pattern = one_beam(10, 0);
  pattern.firing_period_s = 55.296;
  EXPECT_THAT([&] { ScanPattern{pattern}; },
              ThrowsMessage<Error>(HasSubstr("is the period in seconds?")));
}

TEST(ScanPattern, RefusesALidarWithoutBeams) {
  EXPECT_THAT([] { ScanPattern(SpinningPattern{.firing_period_s = 1e-4}); },
              ThrowsMessage<Error>(HasSubstr("beams: there must be at least one")));
}

}  // namespace
}  // namespace groundray
