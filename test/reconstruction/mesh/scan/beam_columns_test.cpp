#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "reconstruction/mesh/scan/organised_scan.h"
#include "test/support/scans/beam_fan.h"
#include "test/support/scans/organised_cells.h"

namespace groundray::beam_columns_test {
namespace {

using namespace groundray::testing;  // NOLINT(google-build-using-namespace)
using Random = std::mt19937_64;

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(BeamColumns, DerivesColumnsFromAzimuth) {
  const ScanReturns fired = seen({}, room);
  const auto made = organise(without_columns(fired));
  EXPECT_EQ(made.scan.rows, 16);
  EXPECT_EQ(made.scan.columns, 360);
  EXPECT_TRUE(made.scan.is_round);
  expect_lattice(made.scan, fired, 360);
  for (std::size_t i = 0; i < made.scan.points_m.size(); ++i) {
    ASSERT_EQ(made.scan.points_m[i], fired.p_S[made.scan.returns[i]]);
    ASSERT_EQ(made.scan.origins_m[i], glm::dvec3(0));
  }
  EXPECT_EQ(made.counts.crowded + made.counts.other_returns + made.counts.no_returns, 0u);
}

TEST(BeamColumns, OneReturnInFourDeterminesTheLattice) {
  Random random(1);
  for (const double present : {0.9, 0.5, 0.25}) {
    const ScanReturns all = seen({.columns = 1800, .columns_per_turn = 1800}, room);
    std::vector<bool> is_there;
    for (std::size_t i = 0; i < all.p_S.size(); ++i)
      is_there.push_back(std::uniform_real_distribution<double>(0, 1)(random) < present);
    const ScanReturns fired = kept(all, [&](std::size_t i) { return is_there[i]; });
    const auto made = organise(without_columns(fired));
    EXPECT_EQ(made.scan.columns, 1800) << present;
    EXPECT_TRUE(made.scan.is_round);
    expect_lattice(made.scan, fired, 1800);
  }
}

// Rings are offset in azimuth by arbitrary fractions of a column: cells of a column lie within half
// a step of its azimuth.
TEST(BeamColumns, ColumnsAreAzimuthsForRingsWithOffsets) {
  Random random(4);
  BeamFan fan{.rings = 32, .columns = 1024, .columns_per_turn = 1024};
  for (int ring = 0; ring < 32; ++ring)
    fan.aside_columns.push_back(std::uniform_real_distribution<double>(-12, 12)(random));
  const double step_rad = 2 * std::numbers::pi / 1024;
  const ScanReturns fired = seen(fan, room);
  ScanReturns timed = without_columns(fired);
  for (const std::int32_t column : fired.columns) timed.times_s.push_back(100 + 1e-4 * column);
  for (const ScanReturns& table : {without_columns(fired), fired, timed}) {
    const auto made = organise(table);
    EXPECT_EQ(made.scan.columns, 1024);
    EXPECT_TRUE(made.scan.is_round);
    EXPECT_EQ(made.counts.crowded, 0u);
    // All azimuths of a column lie in an interval of one step, except for rounding of the phase.
    const double slack = 1 + 1e-6;
    for (int column = 0; column < made.scan.columns; ++column) {
      double low = infinite, high = -infinite, first = nan;
      for (int row = 0; row < made.scan.rows; ++row) {
        const auto cell =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(made.scan.columns) +
            static_cast<std::size_t>(column);
        ASSERT_NE(made.scan.returns[cell], OrganisedScan::none);
        const glm::dvec3& p = made.scan.points_m[cell];
        const double azimuth_rad = std::atan2(p.y, p.x);
        if (row == 0) first = azimuth_rad;
        const double off = std::remainder(azimuth_rad - first, 2 * std::numbers::pi);
        low = std::min(low, off);
        high = std::max(high, off);
      }
      ASSERT_LE(high - low, slack * step_rad) << column;
    }
  }
}

TEST(BeamColumns, GapInAzimuthStaysOpen) {
  const ScanReturns all = seen({}, room);
  const ScanReturns fired =
      kept(all, [&](std::size_t i) { return all.columns[i] < 100 || all.columns[i] > 103; });
  const auto made = organise(without_columns(fired));
  EXPECT_FALSE(made.scan.is_round);
  EXPECT_EQ(made.scan.columns, 356);
  EXPECT_EQ(made.scan.returns[0], 100u) << "it begins after the gap: column 104 of ring 0";
  // The same with given columns: the gap lies inside the grid, which is round.
  const auto given = organise(fired);
  EXPECT_TRUE(given.scan.is_round);
  EXPECT_EQ(given.scan.columns, 360);
  for (std::size_t row = 0; row < 16; ++row) {
    for (std::size_t column = 100; column < 104; ++column)
      EXPECT_EQ(given.scan.returns[row * 360 + column], OrganisedScan::none);
  }
}

TEST(BeamColumns, NarrowFieldsOfViewAreNotRound) {
  for (const double first : {0.3, 2.9, 6.2}) {  // the second and third contain the seam of azimuth
    for (const int direction : {1, -1}) {
      const BeamFan fan{.columns = 90, .first_azimuth_rad = first, .direction = direction};
      const ScanReturns fired = seen(fan, room);
      for (const auto& made : {organise(fired), organise(without_columns(fired))}) {
        EXPECT_FALSE(made.scan.is_round);
        EXPECT_EQ(made.scan.columns, 90);
        EXPECT_EQ(made.counts.crowded, 0u);
      }
    }
  }
}

// The step of the head does not divide a turn: beyond the seam the lattice has another phase.
TEST(BeamColumns, StepsNeedNotDivideATurn) {
  for (const double per_turn : {1808.4, 1799.5, 1024.25}) {
    BeamFan fan{.columns = static_cast<int>(std::ceil(per_turn)),
                .columns_per_turn = per_turn,
                .first_azimuth_rad = 2};
    const ScanReturns fired = seen(fan, room);
    ScanReturns timed = without_columns(fired);
    for (const std::int32_t column : fired.columns) timed.times_s.push_back(55.296e-6 * column);
    const auto by_time = organise(timed);
    EXPECT_EQ(by_time.scan.columns, fan.columns);
    EXPECT_TRUE(by_time.scan.is_round);
    EXPECT_EQ(by_time.counts.crowded, 0u);
    expect_lattice(by_time.scan, fired, fan.columns);
    const auto by_azimuth = organise(without_columns(fired));
    EXPECT_NEAR(by_azimuth.scan.columns, per_turn, 1);
    EXPECT_TRUE(by_azimuth.scan.is_round);
    EXPECT_LE(by_azimuth.counts.crowded, 16u) << "one a ring, at the seam";
    std::size_t empty = 0;
    for (const std::uint32_t row : by_azimuth.scan.returns) empty += row == OrganisedScan::none;
    EXPECT_LE(empty, 16u);
  }
}

// Azimuths in hundredths of a degree, and a motor whose rate swings by a hundredth.
TEST(BeamColumns, FollowsHeadsOfVaryingRate) {
  ScanReturns returns;
  std::vector<std::int32_t> firings;
  Random random(5);
  for (int ring = 0; ring < 16; ++ring) {
    for (int column = 0; column < 1800; ++column) {
      if (std::uniform_real_distribution<double>(0, 1)(random) < 0.3) continue;
      const double share = (column + ring / 16.) / 1800;
      double azimuth_deg = 360 * share + 0.01 * 360 / (2 * std::numbers::pi) *
                                             std::sin(2 * std::numbers::pi * share);
      azimuth_deg = std::round(azimuth_deg * 100) / 100;
      const double e = (2 * ring - 15) * degree, a = azimuth_deg * degree;
      returns.p_S.push_back(
          10. * glm::dvec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)));
      returns.rings.push_back(ring);
      firings.push_back(column);
    }
  }
  const auto made = organise(returns);
  EXPECT_EQ(made.scan.columns, 1800);
  EXPECT_EQ(made.counts.crowded, 0u);
  returns.columns = firings;
  // A ring's phase is known up to a whole column.
  const auto cells = cells_of(made.scan, returns.p_S.size());
  std::vector<int> shift(16, -1);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    int& of_ring = shift[static_cast<std::size_t>(returns.rings[i])];
    const int off = (cells[i].x - firings[i] + 1800) % 1800;
    if (of_ring < 0) of_ring = off;
    ASSERT_EQ(off, of_ring);
  }
  const auto [low, high] = std::ranges::minmax(shift);
  EXPECT_TRUE(high - low <= 1 || high - low == 1799);
}

// Lenses are offset from the axis: azimuths as seen from S's origin run ahead where the surface is
// near. Times do not, nor do azimuths as seen from the beams' origins.
TEST(BeamColumns, ParallaxDoesNotChangeColumnsFromTimes) {
  const BeamFan fan{.columns = 1800, .columns_per_turn = 1800};
  ScanReturns fired = seen(fan, [](const glm::dvec3& towards) {
    return (std::lround(20 * std::atan2(towards.y, towards.x)) % 7 == 0 ? 0.2 : 1) * room(towards);
  });
  for (std::size_t i = 0; i < fired.p_S.size(); ++i) {
    const glm::dvec3 aside = glm::normalize(glm::dvec3(-fired.p_S[i].y, fired.p_S[i].x, 0));
    fired.origins_m.push_back(0.05 * aside);
    fired.p_S[i] += fired.origins_m.back();
    fired.times_s.push_back(fired.columns[i] / 18000. + fired.rings[i] * 2e-6);
  }
  ScanReturns by_both = without_columns(fired), by_time = by_both, by_azimuth = by_both;
  by_time.origins_m.clear();
  by_azimuth.times_s.clear();
  for (const ScanReturns& table : {by_both, by_time, by_azimuth}) {
    SCOPED_TRACE(::testing::Message()
                 << table.times_s.size() << " times, " << table.origins_m.size() << " origins");
    expect_lattice(organise(table).scan, fired, 1800);
  }
}

TEST(BeamColumns, PacketTimesAreNoColumns) {
  const ScanReturns fired = seen({.columns = 1800, .columns_per_turn = 1800}, room);
  ScanReturns timed = without_columns(fired);
  for (const std::int32_t column : fired.columns) {
    const int packet = column / 12;
    timed.times_s.push_back(packet * 1e-3);
  }
  const auto made = organise(timed);
  EXPECT_EQ(made.scan.columns, 1800);
  expect_lattice(made.scan, fired, 1800);
}

// Some rings fire twice as often as most: each second pulse of theirs finds its cell occupied.
TEST(BeamColumns, KeepsOneOfTwoPulsesInACell) {
  ScanReturns returns;
  for (int ring = 0; ring < 8; ++ring) {
    const int pulses = ring == 3 ? 720 : 360;
    for (int k = 0; k < pulses; ++k) {
      const double a = 2 * std::numbers::pi * (k + 0.1 * (k % 2)) / pulses, e = 0.02 * ring;
      returns.p_S.emplace_back(10 * std::cos(e) * std::cos(a), 10 * std::cos(e) * std::sin(a),
                               10 * std::sin(e));
      returns.rings.push_back(ring);
    }
  }
  const auto made = organise(returns);
  EXPECT_EQ(made.scan.columns, 360);
  EXPECT_EQ(made.counts.crowded, 360u);
  EXPECT_EQ(std::ranges::count(made.scan.returns, OrganisedScan::none), 0);
}

// If many rings fire half as often as the others, columns follow the slower rings: surplus returns
// of the faster ones can be omitted, but missing returns cannot be linked.
TEST(BeamColumns, ColumnsFollowTheCoarserRings) {
  ScanReturns returns;
  for (int ring = 0; ring < 16; ++ring) {
    const int pulses = ring % 3 == 0 ? 360 : 720;
    for (int k = 0; k < pulses; ++k) {
      const double a = 2 * std::numbers::pi * (k + 0.3) / pulses, e = 0.02 * ring;
      returns.p_S.emplace_back(10 * std::cos(e) * std::cos(a), 10 * std::cos(e) * std::sin(a),
                               10 * std::sin(e));
      returns.rings.push_back(ring);
    }
  }
  const auto made = organise(returns);
  EXPECT_EQ(made.scan.columns, 360);
  EXPECT_EQ(made.counts.crowded, 10u * 360);
  EXPECT_EQ(std::ranges::count(made.scan.returns, OrganisedScan::none), 0);
}

// Drivers may get the step between packets wrong: the last of each 12 pulses is reported three
// quarters of a step late, and some before it slightly late. All keep their cells.
TEST(BeamColumns, LatePulsesKeepTheirCells) {
  ScanReturns fired = seen({.columns = 1800, .columns_per_turn = 1800}, room);
  for (std::size_t i = 0; i < fired.p_S.size(); ++i) {
    const int in_packet = fired.columns[i] % 12;
    const double late = in_packet == 11 ? 0.75 : in_packet == 10 ? 0.3 : 0;
    const double turn = late * 2 * std::numbers::pi / 1800;
    const glm::dvec3 p = fired.p_S[i];
    fired.p_S[i] = {std::cos(turn) * p.x - std::sin(turn) * p.y,
                    std::sin(turn) * p.x + std::cos(turn) * p.y, p.z};
  }
  const auto made = organise(without_columns(fired));
  EXPECT_EQ(made.counts.crowded + made.counts.other_returns, 0u);
  EXPECT_TRUE(made.scan.is_round);
  expect_lattice(made.scan, fired, 1800);
}

TEST(BeamColumns, InvalidTimesAreIgnored) {
  const ScanReturns fired = seen({}, room);
  for (const double odd : {nan, infinite, 1e300, 1e11}) {
    ScanReturns timed = without_columns(fired);
    for (const std::int32_t column : fired.columns) timed.times_s.push_back(1e-4 * column);
    timed.times_s[7] = odd;
    const auto made = organise(timed);
    EXPECT_EQ(made.scan.columns, 360);
    expect_lattice(made.scan, fired, 360);
  }
}

}  // namespace
}  // namespace groundray::beam_columns_test
