#include "sensors/lidar/pattern/scan_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <random>

#include "core/error.h"

namespace groundray::scan_pattern_test {
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

TEST(ScanPattern, FiresBeamsInTimeOrderAndKeepsTheTablesOrderAtEqualTimes) {
  SpinningPattern pattern{.firing_period_s = 50e-6};
  const double times_us[] = {20, 0, 10, 0, 20, 10, 0};
  for (std::uint16_t ring = 0; const double time_us : times_us) {
    pattern.beams.push_back({.firing_time_s = time_us / 1e6, .ring = ring++});
  }
  const SpinningScan scan(pattern);
  std::vector<std::uint16_t> rings;
  for (const auto& shot : scan.cycle().shots()) rings.push_back(shot.ring);
  EXPECT_THAT(rings, ::testing::ElementsAre(1, 3, 6, 2, 5, 0, 4));
}

TEST(ScanPattern, BeamsThatFireTogetherAreOneVolley) {
  SpinningPattern pattern{.firing_period_s = 50e-6};
  for (const double time_us : {20., 0., 10., 0., 20., 10., 0.}) {
    pattern.beams.push_back({.firing_time_s = time_us / 1e6});
  }
  const SpinningScan scan(pattern);
  ASSERT_EQ(scan.cycle().volleys().size(), 3u);
  int begin = 0;
  const int sizes[] = {3, 2, 2};
  for (int i = 0; i < 3; ++i) {
    const auto& volley = scan.cycle().volleys()[static_cast<std::size_t>(i)];
    EXPECT_EQ(volley.begin, begin);
    EXPECT_EQ(volley.end, begin += sizes[i]);
    EXPECT_DOUBLE_EQ(volley.firing_time_s, 10e-6 * i);
  }
}

TEST(ScanPattern, ElevationPointsUpAndAzimuthOffsetPointsLeft) {
  SpinningPattern pattern = one_beam(10, 100);
  pattern.beams = {{.elevation_rad = pi / 6, .azimuth_offset_rad = pi / 2}};
  const glm::dvec3 direction = SpinningScan(pattern).cycle().shots()[0].direction;
  EXPECT_NEAR(direction.x, 0, 2 * epsilon);  // one rounding of each angle, sine and product
  EXPECT_NEAR(direction.y, std::sqrt(0.75), 2 * epsilon);
  EXPECT_NEAR(direction.z, 0.5, 2 * epsilon);
}

TEST(ScanPattern, TurnsOf1024EqualColumnsBeginAtEvery1024thSequence) {
  const SpinningScan scan(one_beam(10, 97.65625));
  for (const std::int64_t sweep : {0, 1, 2, 3, 7, 1000, 99'999, 1'000'000, 50'000'000}) {
    EXPECT_EQ(scan.first_sequence(sweep), 1024 * sweep);
  }
}

// Sequence k begins at k * 55 296 ns and a turn takes 1e8 ns: whole numbers, so the oracle has no
// rounding.
TEST(ScanPattern, SweepsBeginWithTheFirstSequenceOfTheirTurn) {
  const SpinningScan scan(one_beam(10, 55.296));
  for (std::int64_t sweep = 0; sweep < 20'000; ++sweep) {
    const std::int64_t turn_ns = sweep * 100'000'000;
    ASSERT_EQ(scan.first_sequence(sweep), (turn_ns + 55'295) / 55'296) << "sweep " << sweep;
  }
}

TEST(ScanPattern, OneSequenceMayFillATurn) {
  EXPECT_EQ(SpinningScan(one_beam(10, 100'000)).first_sequence(5), 5);
  EXPECT_EQ(ScanPattern(one_beam(10, 100'000)).stamp(5), 500ms);
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
  EXPECT_DOUBLE_EQ(SpinningScan(pattern).cycle().head().angle_rad(0.025), 1.5 * pi);
  pattern.sense = SpinningPattern::Sense::CounterClockwise;
  EXPECT_DOUBLE_EQ(SpinningScan(pattern).cycle().head().angle_rad(0.025), 0.5 * pi);
  pattern.start_azimuth_rad = -pi;
  EXPECT_DOUBLE_EQ(SpinningScan(pattern).cycle().head().angle_rad(0.025), 1.5 * pi);
}

// Rate and time are binary fractions, so their product is a whole number over 2^30 and known
// exactly. It has more bits than a double: rounded, it would be up to 6e-9 rad off after 10^6 s.
TEST(ScanPattern, SpinStaysAccurateAfterDays) {
  constexpr double tolerance =
      4 * pi * epsilon;  // one rounding of the fraction and one of the angle
  SpinningPattern pattern = one_beam(10211. / 1024, 100);
  pattern.sense = SpinningPattern::Sense::CounterClockwise;
  const SpinningScan scan(pattern);
  std::mt19937_64 random(7);
  for (int i = 0; i < 100'000; ++i) {
    const std::uint64_t time = random() >> 24;  // in 2^-20 s
    const std::uint64_t fraction = 10211 * time % (1u << 30);
    const double expected = 2 * pi * std::ldexp(static_cast<double>(fraction), -30);
    const double spin = scan.cycle().head().angle_rad(std::ldexp(static_cast<double>(time), -20));
    ASSERT_LE(std::abs(std::remainder(spin - expected, 2 * pi)), tolerance) << time;
  }
}

TEST(ScanPattern, SpinAngleIsLessThanATurn) {
  const SpinningScan scan(one_beam(10, 100));
  for (const double time_s :
       {0., 1e-300, 1e-20, 1e-17, 0.1, std::nextafter(0.1, 0), std::nextafter(0.1, 1)}) {
    EXPECT_GE(scan.cycle().head().angle_rad(time_s), 0) << time_s;
    EXPECT_LT(scan.cycle().head().angle_rad(time_s), 2 * pi) << time_s;
  }
}

TEST(ScanPattern, RejectsAPatternWithEveryFaultInOneError) {
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

TEST(ScanPattern, RejectsAPeriodThatIsNotInSeconds) {
  SpinningPattern pattern = one_beam(10, 0);
  pattern.firing_period_s = 55.296;
  EXPECT_THAT([&] { ScanPattern{pattern}; },
              ThrowsMessage<Error>(HasSubstr("is the period in seconds?")));
}

TEST(ScanPattern, RejectsALidarWithoutBeams) {
  EXPECT_THAT([] { ScanPattern(SpinningPattern{.firing_period_s = 1e-4}); },
              ThrowsMessage<Error>(HasSubstr("beams: there must be at least one")));
}

PulseBatch sweep_of(const ScanPattern& scan, std::int64_t sweep) {
  PulseBatch batch;
  scan.fill(sweep, 0, scan.pulses(sweep), batch);
  return batch;
}

SpinningPattern seven_beams() {
  SpinningPattern pattern{.rate_hz = 10, .start_azimuth_rad = 0.3, .firing_period_s = 55.296e-6};
  for (std::uint16_t i = 0; i < 7; ++i) {
    const int pair = i / 2;
    pattern.beams.push_back({.elevation_rad = 0.1 * i - 0.3,
                             .azimuth_offset_rad = 0.02 * i,
                             .origin_m = {0.01 * i, 0.02, -0.03},
                             .firing_time_s = 2.304e-6 * pair,
                             .ring = i});
  }
  return pattern;
}

// Each coordinate of a unit vector is the sum of two products: one epsilon of rounding in total.
TEST(ScanPattern, FillReturnsTheShotsOfEachVolleyRotatedByTheSpinAngle) {
  const ScanPattern scan(seven_beams());
  const SpinningScan head(seven_beams());
  for (const std::int64_t sweep : {0, 1, 864'000}) {
    const PulseBatch batch = sweep_of(scan, sweep);
    const std::int64_t first = head.first_sequence(sweep);
    const std::int64_t sequences = head.first_sequence(sweep + 1) - first;
    ASSERT_EQ(scan.pulses(sweep), 7 * sequences);
    ASSERT_EQ(batch.volleys.size(),
              head.cycle().volleys().size() * static_cast<std::size_t>(sequences));
    std::size_t row = 0;
    auto filled = batch.volleys.begin();
    for (std::int64_t k = 0; k < sequences; ++k) {
      for (const auto& volley : head.cycle().volleys()) {
        const double time_s = head.cycle().firing_time_s(first + k, volley);
        const double spin_rad = head.cycle().head().angle_rad(time_s);
        const double c = std::cos(spin_rad);
        const double s = std::sin(spin_rad);
        ASSERT_EQ(filled->time_s, time_s);
        ASSERT_EQ(filled->begin, row);
        for (int i = volley.begin; i < volley.end; ++i, ++row) {
          const auto& [d, o, ring] = head.cycle().shots()[static_cast<std::size_t>(i)];
          const glm::dvec3 direction(c * d.x - s * d.y, s * d.x + c * d.y, d.z);
          const glm::dvec3 origin_m(c * o.x - s * o.y, s * o.x + c * o.y, o.z);
          ASSERT_LE(glm::distance(batch.direction[row], direction), 2 * epsilon);
          ASSERT_LE(glm::distance(batch.origin_m[row], origin_m), epsilon);
          ASSERT_EQ(batch.ring[row], ring);
        }
        ASSERT_EQ(filled++->end, row);
      }
    }
  }
}

TEST(ScanPattern, HorizontalAxesOfSpinningBeamsPointTowardsIncreasingAzimuth) {
  const PulseBatch batch = sweep_of(ScanPattern(seven_beams()), 0);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const glm::dvec3& d = batch.direction[i];
    const double level = std::hypot(d.x, d.y);
    const glm::dvec3 expected(-d.y / level, d.x / level, 0);
    ASSERT_LE(glm::distance(batch.horizontal[i], expected), 4 * epsilon);
  }
}

std::vector<PatternSpec> one_of_each_kind() {
  SpinningPattern loops = seven_beams();
  for (std::size_t i = 0; i < loops.beams.size(); ++i) loops.beams[i].loop = i < 3 ? 0 : 1;
  loops.field_of_view = AzimuthInterval{-1, 2};
  LinePattern line;
  line.from_rad = -0.5;
  line.to_rad = 1;
  line.line_rate_hz = 100;
  line.pulse_rate_hz = 10'000;
  line.lines_per_sweep = 7;
  line.head_rate_hz = 0.5;
  RisleyPattern risley;
  risley.prisms = {{.wedge_rad = 0.3, .rate_hz = 131.5}, {.wedge_rad = 0.3, .rate_hz = -40.8}};
  risley.beams = {{.ring = 1}, {.elevation_rad = 0.01, .ring = 2}};
  risley.firing_period_s = 7e-5;
  const TablePattern raster = raster_pattern(
      {.rows = 8, .columns = 100, .horizontal_view_rad = 1, .vertical_view_rad = 0.5}, 1e-3, 0,
      0.1);
  return {seven_beams(), loops, line, risley, raster};
}

TEST(ScanPattern, PulsesDoNotDependOnHowASweepIsSplit) {
  std::mt19937_64 random(7);
  for (const PatternSpec& spec : one_of_each_kind()) {
    const ScanPattern scan(spec);
    for (const std::int64_t sweep : {0, 1, 5, 12345}) {
      const PulseBatch whole = sweep_of(scan, sweep);
      const std::int64_t pulses = scan.pulses(sweep);
      PulseBatch part;
      std::size_t row = 0;
      for (std::int64_t begin = 0; begin < pulses;) {
        const auto length = 1 + static_cast<std::int64_t>(random() % 100);
        const std::int64_t end = std::min(pulses, begin + length);
        scan.fill(sweep, begin, end, part);
        ASSERT_EQ(part.volleys.front().begin, 0u);
        ASSERT_EQ(part.volleys.back().end, part.size());
        auto volley = std::ranges::find_if(
            whole.volleys, [&](const auto& v) { return row >= v.begin && row < v.end; });
        for (const auto& cut : part.volleys) {
          ASSERT_EQ(cut.time_s, volley++->time_s);
          for (std::size_t i = cut.begin; i < cut.end; ++i, ++row) {
            ASSERT_EQ(part.direction[i], whole.direction[row]);
            ASSERT_EQ(part.origin_m[i], whole.origin_m[row]);
            ASSERT_EQ(part.horizontal[i], whole.horizontal[row]);
            ASSERT_EQ(part.ring[i], whole.ring[row]);
          }
        }
        begin = end;
      }
      ASSERT_EQ(row, whole.size());
    }
  }
}

TEST(ScanPattern, SweepsFollowEachOtherInTimeAtTheirRate) {
  for (const PatternSpec& spec : one_of_each_kind()) {
    const ScanPattern scan(spec);
    for (std::int64_t sweep = 0; sweep < 50; ++sweep) {
      const PulseBatch batch = sweep_of(scan, sweep);
      ASSERT_FALSE(batch.volleys.empty());
      EXPECT_TRUE(std::ranges::is_sorted(batch.volleys, {}, &PulseBatch::Volley::time_s));
      const auto nanoseconds = [](double s) { return std::llround(s * 1e9); };
      EXPECT_EQ(scan.stamp(sweep).count(), nanoseconds(batch.volleys.front().time_s));
      EXPECT_EQ(scan.last_firing(sweep).count(), nanoseconds(batch.volleys.back().time_s));
      EXPECT_LT(scan.last_firing(sweep), scan.stamp(sweep + 1));
    }
    const double elapsed_s = 1e-9 * static_cast<double>((scan.stamp(1000) - scan.stamp(0)).count());
    EXPECT_NEAR(elapsed_s * scan.sweep_rate_hz(), 1000, 0.01);  // a firing period or two
  }
}

TEST(ScanPattern, LoopsRepeatInOrder) {
  SpinningPattern pattern{.firing_period_s = 0.1 / 9};  // an odd number of sequences per turn
  pattern.beams = {{.firing_time_s = 2e-3, .ring = 0, .loop = 0},
                   {.firing_time_s = 1e-3, .ring = 1, .loop = 1},
                   {.firing_time_s = 1e-3, .ring = 2, .loop = 0},
                   {.firing_time_s = 5e-3, .ring = 2, .loop = 1},
                   {.ring = 3, .loop = 2}};
  const ScanPattern scan(pattern);
  EXPECT_EQ(scan.neighbour_stride(), 5);
  const std::vector<std::uint16_t> cycle{2, 0, 1, 2,
                                         3};  // loops 0, 1, 2, each ordered by firing time
  std::size_t next = 0;
  for (std::int64_t sweep = 0; sweep < 10; ++sweep) {
    const PulseBatch batch = sweep_of(scan, sweep);
    EXPECT_EQ(batch.size(), 15u);
    for (const std::uint16_t ring : batch.ring) ASSERT_EQ(ring, cycle[next++ % 5]);
  }
}

// Scanners in one plane fire at both ends of their field of view.
TEST(ScanPattern, FieldOfViewFiresAtBothOfItsEnds) {
  struct View {
    double width_deg, step_deg, rate_hz;
    std::size_t pulses;
  };
  const View views[] = {{190, 1. / 6, 25, 1141},
                        {190, 0.25, 35, 761},
                        {190, 1, 75, 191},
                        {180, 1, 75, 181},
                        {180, 0.5, 37.5, 361}};
  for (const auto& [width_deg, step_deg, rate_hz, pulses] : views) {
    SpinningPattern pattern = one_beam(rate_hz, 1e6 * step_deg / 360 / rate_hz);
    pattern.sense = SpinningPattern::Sense::CounterClockwise;
    const double half_rad = width_deg / 2 * pi / 180;
    pattern.start_azimuth_rad = -half_rad;
    pattern.field_of_view = AzimuthInterval{-half_rad, half_rad};
    const ScanPattern scan(pattern);
    for (std::int64_t sweep = 0; sweep < 2000; ++sweep) {
      ASSERT_EQ(scan.pulses(sweep), pulses) << sweep;
    }
    const PulseBatch batch = sweep_of(scan, 3);
    for (std::size_t i = 0; i < pulses; ++i) {
      const double azimuth = std::atan2(batch.direction[i].y, batch.direction[i].x);
      const double expected = (static_cast<double>(i) * step_deg - width_deg / 2) * pi / 180;
      ASSERT_NEAR(azimuth, expected, 1e-12);  // rounding of the period, after three turns
    }
  }
}

// The oracle fires every sequence of the same head without a field of view and keeps those whose
// azimuth lies inside it.
TEST(ScanPattern, NothingFiresOutsideTheFieldOfView) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-pi, pi);
  for (int trial = 0; trial < 200; ++trial) {
    SpinningPattern pattern = one_beam(10, 1e5 / (20 + 5 * uniform(random)));
    pattern.sense = trial % 2 == 0 ? SpinningPattern::Sense::Clockwise
                                   : SpinningPattern::Sense::CounterClockwise;
    pattern.start_azimuth_rad = 3 * uniform(random);
    const ScanPattern all(pattern);
    const HeadTurn head = SpinningScan(pattern).cycle().head();
    const double from_rad = 2 * uniform(random);
    const double width_rad = pi + 0.9 * uniform(random);
    pattern.field_of_view = AzimuthInterval{from_rad, from_rad + width_rad};
    if (width_rad < 2 * pi * pattern.rate_hz * pattern.firing_period_s) continue;
    const ScanPattern scan(pattern);
    for (std::int64_t sweep = 0; sweep < 5; ++sweep) {
      std::vector<double> expected_s;
      const PulseBatch every = sweep_of(all, sweep);
      for (const auto& volley : every.volleys) {
        const double ahead = std::fmod(head.angle_rad(volley.time_s) - from_rad + 6 * pi, 2 * pi);
        if (ahead <= width_rad) expected_s.push_back(volley.time_s);
      }
      std::vector<double> times_s;
      for (const auto& volley : sweep_of(scan, sweep).volleys) times_s.push_back(volley.time_s);
      ASSERT_EQ(times_s, expected_s) << trial << ", sweep " << sweep;
    }
  }
}

TEST(ScanPattern, RejectsFieldsOfViewAndLoopsOutOfBounds) {
  SpinningPattern pattern = one_beam(10, 100);
  pattern.field_of_view = AzimuthInterval{0.5, -0.5};
  pattern.beams = {{.loop = 2}, {.loop = -1}};
  EXPECT_THAT([&] { ScanPattern{pattern}; },
              ThrowsMessage<Error>(AllOf(HasSubstr("are its ends swapped?"),
                                         HasSubstr("beams[1].loop = -1"),
                                         HasSubstr("number them from 0 without gaps"))));
  pattern.beams = {Beam{}};
  pattern.field_of_view = AzimuthInterval{-90, 90};
  EXPECT_THAT([&] { ScanPattern{pattern}; },
              ThrowsMessage<Error>(HasSubstr("at most one turn wide: is it in degrees?")));
}

}  // namespace
}  // namespace groundray::scan_pattern_test
