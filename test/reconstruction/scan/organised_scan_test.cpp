#include "reconstruction/scan/organised_scan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "test/support/beam_fan.h"

namespace groundray {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)
using Random = std::mt19937_64;

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// A room with four different walls, so that no two beams meet the same point.
double room(const glm::dvec3& towards) {
  double r = infinite;
  for (const glm::dvec4& wall : {glm::dvec4(1, 0.1, 0, 6), glm::dvec4(-1, 0, 0.05, 9),
                                 glm::dvec4(0, 1, 0, 7), glm::dvec4(0.1, -1, 0, 5)}) {
    const double along = glm::dot(glm::dvec3(wall), towards);
    if (along > 0) r = std::min(r, wall.w / along);
  }
  return r;
}

ScanReturns without_columns(ScanReturns returns) {
  returns.columns.clear();
  return returns;
}

// Where each row of the table went; {-1, -1} if nowhere.
std::vector<glm::ivec2> cells_of(const OrganisedScan& scan, std::size_t rows) {
  std::vector<glm::ivec2> cells(rows, {-1, -1});
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    if (scan.returns[i] == OrganisedScan::none) continue;
    const auto columns = static_cast<std::size_t>(scan.columns);
    cells[scan.returns[i]] = {static_cast<int>(i % columns), static_cast<int>(i / columns)};
  }
  return cells;
}

// Whether all returns lie as they were fired: row by ring, column by firing but for a turn.
void expect_lattice(const OrganisedScan& scan, const ScanReturns& fired, int turn) {
  const auto cells = cells_of(scan, fired.p_S.size());
  int shift = -1;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!std::isfinite(fired.p_S[i].x)) continue;
    ASSERT_NE(cells[i].x, -1) << "row " << i;
    EXPECT_EQ(cells[i].y, fired.rings[i]);
    const int off = ((cells[i].x - fired.columns[i]) % turn + turn) % turn;
    if (shift < 0) shift = off;
    ASSERT_EQ(off, shift) << "row " << i;
  }
}

TEST(OrganisedScan, ColumnsComeFromAzimuth) {
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

TEST(OrganisedScan, OneReturnInFourTellsTheLattice) {
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

TEST(OrganisedScan, RingsAreOrderedByElevation) {
  const ScanReturns fired = seen({}, room);
  ScanReturns permuted = without_columns(fired);
  for (std::int32_t& ring : permuted.rings) ring = 1000 - 37 * ((ring * 7) % 16);  // with gaps
  const auto made = organise(permuted), plain = organise(without_columns(fired));
  EXPECT_EQ(made.scan.returns, plain.scan.returns);
  EXPECT_EQ(made.scan.points_m, plain.scan.points_m);
}

TEST(OrganisedScan, OrderOfTheTableDoesNotMatter) {
  const ScanReturns fired = without_columns(
      seen({.columns = 1809, .columns_per_turn = 1808.4, .first_azimuth_rad = 1}, room));
  std::vector<std::size_t> order(fired.p_S.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), Random(2));
  ScanReturns shuffled;
  for (const std::size_t i : order) {
    shuffled.p_S.push_back(fired.p_S[i]);
    shuffled.rings.push_back(fired.rings[i]);
  }
  const OrganisedScan a = organise(fired).scan, b = organise(shuffled).scan;
  ASSERT_EQ(a.columns, b.columns);
  for (std::size_t i = 0; i < a.returns.size(); ++i) {
    ASSERT_EQ(a.returns[i] == OrganisedScan::none, b.returns[i] == OrganisedScan::none);
    if (a.returns[i] == OrganisedScan::none) continue;
    ASSERT_EQ(a.points_m[i], b.points_m[i]);
  }
}

TEST(OrganisedScan, BeamsAreToldApartByElevation) {
  const BeamFan fan{.rings = 64, .lowest_rad = -25 * degree, .highest_rad = 3 * degree};
  ScanReturns fired = seen(fan, room);
  for (glm::dvec3& p : fired.p_S) p = glm::vec3(p);  // as files have them
  ScanReturns bare = without_columns(fired);
  const auto with_rings = organise(bare);
  bare.rings.clear();
  const auto without_rings = organise(bare);
  EXPECT_EQ(without_rings.scan.rows, 64);
  EXPECT_EQ(without_rings.scan.returns, with_rings.scan.returns);
}

// As KITTI's files: one ring after the other, from the highest down, with neither rings nor times;
// lenses are beside and above S's origin, so elevations of a beam depend on the range, and a third
// of the returns are missing.
TEST(OrganisedScan, BeamsAreToldApartByTheOrderOfTheTable) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> noise(0, 0.02);
  for (const double seam : {0., 0.7, std::numbers::pi}) {
    for (const auto& [direction, aside] : {std::pair(1, 0.), {1, 44.3}, {-1, 44.3}}) {
      BeamFan fan{.rings = 64,
                  .lowest_rad = 2 * degree,
                  .highest_rad = -24.9 * degree,
                  .columns = 2000,
                  .columns_per_turn = 2000,
                  .first_azimuth_rad = seam + 1e-4,
                  .direction = direction};
      for (int ring = 0; ring < 64; ++ring)  // up to 8 degrees, as those of HDL-64E
        fan.aside_columns.push_back(aside * std::sin(5 * ring) + 0.3 * (ring % 3));
      ScanReturns fired = seen(fan, [&](const glm::dvec3& towards) {
        const double r = std::min(room(towards), -1.73 / std::min(towards.z, -1e-3));
        return uniform(random) < 0.33 ? infinite : r + noise(random);
      });
      for (glm::dvec3& p : fired.p_S) {
        p += 0.026 * glm::normalize(glm::dvec3(-p.y, p.x, 0)) + glm::dvec3(0, 0, 0.01);
        p = glm::vec3(p);
      }
      ScanReturns bare;
      bare.p_S = fired.p_S;
      const auto made = organise(bare);
      EXPECT_EQ(made.scan.rows, 64);
      EXPECT_EQ(made.scan.columns, 2000);
      EXPECT_TRUE(made.scan.is_round);
      const auto cells = cells_of(made.scan, fired.p_S.size());
      std::size_t placed = 0, there = 0;
      for (std::size_t i = 0; i < cells.size(); ++i) {
        if (!std::isfinite(fired.p_S[i].x)) continue;
        ++there;
        placed += cells[i].y == 63 - fired.rings[i];
      }
      EXPECT_GE(static_cast<double>(placed), 0.99 * static_cast<double>(there));
    }
  }
}

TEST(OrganisedScan, CloudsWithoutBeamsAreRefused) {
  Random random(3);
  std::normal_distribution<double> normal;
  ScanReturns cloud;
  for (int i = 0; i < 5000; ++i)
    cloud.p_S.emplace_back(normal(random), normal(random), normal(random));
  try {
    organise(cloud);
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(), AllOf(HasSubstr("their 5000 elevations do not cluster"),
                                    HasSubstr("link them as points without order")));
  }
  // Rings alone do not help a rosette.
  for (int i = 0; i < 5000; ++i) cloud.rings.push_back(i % 6);
  try {
    organise(cloud);
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(), AllOf(HasSubstr("not at equal steps"),
                                    HasSubstr("link them as points without order")));
  }
}

// Elevations in hundredths of a degree that wander with azimuth cluster, but not as beams.
TEST(OrganisedScan, RoundedElevationsAreNoBeams) {
  Random random(7);
  ScanReturns cloud;
  for (int beam = 0; beam < 32; ++beam) {
    for (int column = 0; column < 300; ++column) {
      if (std::uniform_real_distribution<double>(0, 1)(random) < 0.5) continue;
      const double a = 0.2 * column * degree;
      const double e =
          std::round(100 * (0.31 * beam + 0.4 * std::sin(3 * a + beam))) / 100 * degree;
      cloud.p_S.push_back(
          10. * glm::dvec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)));
    }
  }
  try {
    organise(cloud);
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(), HasSubstr("give the rings, or link them as points without order"));
  }
}

// Rings that look aside, by any part of a column: cells of a column look within half a step of
// its azimuth.
TEST(OrganisedScan, ColumnsAreAzimuthsWhereRingsLookAside) {
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
    // All azimuths of a column lie in an interval of one step, but for rounding of the phase.
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

TEST(OrganisedScan, GapInAzimuthStaysOpen) {
  const ScanReturns all = seen({}, room);
  const ScanReturns fired =
      kept(all, [&](std::size_t i) { return all.columns[i] < 100 || all.columns[i] > 103; });
  const auto made = organise(without_columns(fired));
  EXPECT_FALSE(made.scan.is_round);
  EXPECT_EQ(made.scan.columns, 356);
  EXPECT_EQ(made.scan.returns[0], 100u) << "it begins after the gap: column 104 of ring 0";
  // The same with the columns given: the gap lies amid the grid, which is round.
  const auto given = organise(fired);
  EXPECT_TRUE(given.scan.is_round);
  EXPECT_EQ(given.scan.columns, 360);
  for (std::size_t row = 0; row < 16; ++row) {
    for (std::size_t column = 100; column < 104; ++column)
      EXPECT_EQ(given.scan.returns[row * 360 + column], OrganisedScan::none);
  }
}

TEST(OrganisedScan, NarrowFieldsOfViewAreNotRound) {
  for (const double first : {0.3, 2.9, 6.2}) {  // the second and third hold the seams of azimuth
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

// A head whose step does not divide a turn: beyond the seam the lattice has another phase.
TEST(OrganisedScan, StepsNeedNotDivideATurn) {
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
TEST(OrganisedScan, UnsteadyHeadsAreFollowed) {
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
  // A ring's phase is known but for a whole column.
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

// Lenses beside the axis: azimuths as seen from S's origin run ahead where it is near. Times do
// not, nor do azimuths from where beams began.
TEST(OrganisedScan, ParallaxDoesNotTurnTimesIntoOtherColumns) {
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

TEST(OrganisedScan, TimesOfPacketsAreNoColumns) {
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

TEST(OrganisedScan, OneReturnStandsForAPulse) {
  const ScanReturns nearest = seen({}, [](const glm::dvec3&) { return 5.; });
  ScanReturns both = nearest;
  both.intensity.assign(both.p_S.size(), 1);
  for (std::size_t i = 0; i < nearest.p_S.size(); ++i) {  // two more of each, the farthest amid
    for (const double farther : {3., 2.}) {
      both.p_S.push_back(nearest.p_S[i] * farther);
      both.rings.push_back(nearest.rings[i]);
      both.columns.push_back(nearest.columns[i]);
      both.intensity.push_back(farther == 2 ? 7.f : 0.5f);
    }
  }
  ScanReturns timed = without_columns(both);
  for (const std::int32_t column : both.columns) timed.times_s.push_back(1e-4 * column);
  for (const ScanReturns& table : {both, without_columns(both), timed}) {
    for (const auto& [choice, range_m] :
         {std::pair(ReturnChoice::First, 5.), std::pair(ReturnChoice::Last, 15.),
          std::pair(ReturnChoice::Strongest, 10.)}) {
      const auto made = organise(table, choice);
      EXPECT_EQ(made.counts.other_returns, 2 * nearest.p_S.size());
      EXPECT_EQ(made.counts.crowded, 0u);
      for (const glm::dvec3& p : made.scan.points_m) ASSERT_NEAR(glm::length(p), range_m, 1e-9);
    }
  }
}

// Some rings fire twice as often as most: every other pulse of theirs finds its cell taken.
TEST(OrganisedScan, OfTwoPulsesInACellOneIsKept) {
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

// Where many rings fire half as often as the others, columns are theirs: what the others have
// besides can be left out, but what is not there cannot be linked.
TEST(OrganisedScan, StepsAreThoseOfTheCoarserRings) {
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

// Drivers that mistake the step from packet to packet: the last pulse of each 12 is told three
// quarters of a step late, some before it a little. All keep their cells.
TEST(OrganisedScan, PulsesThatComeLateKeepTheirCells) {
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

TEST(OrganisedScan, RowsThatAreNoReturnsAreCounted) {
  ScanReturns fired = seen({}, room);
  const glm::dvec3 none(nan), far(infinite, 0, 0), zero(0);
  fired.p_S[10] = none;
  fired.p_S[11] = far;
  fired.p_S[12] = zero;
  fired.p_S[13] = {1e200, 0, 0};
  const auto made = organise(fired);
  EXPECT_EQ(made.counts.no_returns, 4u);
  EXPECT_EQ(made.scan.columns, 360);
  for (const std::size_t cell : {10u, 11u, 12u, 13u}) {
    EXPECT_EQ(made.scan.returns[cell], OrganisedScan::none);
    EXPECT_TRUE(std::isnan(made.scan.points_m[cell].x));
  }
}

TEST(OrganisedScan, NothingMakesAnEmptyGrid) {
  for (const ScanReturns& table :
       {ScanReturns{}, ScanReturns{.p_S = {glm::dvec3(nan)}},
        ScanReturns{.p_S = {glm::dvec3(0)}, .rings = {3}, .columns = {7}, .times_s = {1}}}) {
    const auto made = organise(table);
    EXPECT_EQ(made.scan.rows * made.scan.columns, 0);
    EXPECT_EQ(made.scan.points_m.size(), 0u);
    EXPECT_EQ(made.counts.no_returns, table.p_S.size());
  }
}

// Lines of an image that shows nothing are lines without a column.
TEST(OrganisedScan, LinesWithoutReturnsAreNoFault) {
  const ScanReturns dark{.p_S = std::vector<glm::dvec3>(6, glm::dvec3(0)),
                         .rings = {0, 1, 2, 0, 1, 2}};
  const auto made = organise(dark, ReturnChoice::Last, RowOrder::Number);
  EXPECT_EQ(made.scan.rows, 3);
  EXPECT_EQ(made.scan.columns, 0);
}

TEST(OrganisedScan, FewReturnsAreNoFault) {
  for (int count = 1; count < 6; ++count) {
    ScanReturns table;
    for (int i = 0; i < count; ++i) {
      table.p_S.emplace_back(5, 0.3 * i * i, 0.1 * (i % 2));
      table.rings.push_back(i % 2);
    }
    const auto made = organise(table);
    EXPECT_EQ(made.counts.crowded +
                  static_cast<std::size_t>(std::ranges::count_if(
                      made.scan.returns, [](auto row) { return row != OrganisedScan::none; })),
              static_cast<std::size_t>(count));
  }
}

TEST(OrganisedScan, ScannerInOnePlaneIsOneRow) {
  ScanReturns fired = seen({.rings = 1, .lowest_rad = 0, .columns = 270}, room);
  fired.rings.clear();
  const auto made = organise(without_columns(fired));
  EXPECT_EQ(made.scan.rows, 1);
  EXPECT_EQ(made.scan.columns, 270);
  EXPECT_FALSE(made.scan.is_round);
}

// An image of 12 x 20 points, as of a camera that measures depth, whose lines run downwards.
TEST(OrganisedScan, LinesOfAnImageKeepTheirOrder) {
  ScanReturns image;
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 20; ++column) {
      const bool is_there = row != 5 && row != 11 && column != 0;
      image.p_S.push_back(is_there ? glm::dvec3(4, 0.1 * (10 - column), 0.1 * (6 - row))
                                   : glm::dvec3(nan));
      image.rings.push_back(row);
      image.columns.push_back(column);
    }
  }
  const auto made = organise(image, ReturnChoice::Last, RowOrder::Number);
  EXPECT_EQ(made.scan.rows, 12);
  EXPECT_EQ(made.scan.columns, 20);
  EXPECT_FALSE(made.scan.is_round);
  for (std::size_t i = 0; i < image.p_S.size(); ++i) {
    if (std::isfinite(image.p_S[i].x)) {
      EXPECT_EQ(made.scan.returns[i], i);
    } else {
      EXPECT_EQ(made.scan.returns[i], OrganisedScan::none);
    }
  }
}

TEST(OrganisedScan, WhatIsKnownOfReturnsGoesWithThem) {
  ScanReturns fired = seen({}, room);
  for (std::size_t i = 0; i < fired.p_S.size(); ++i) {
    fired.sd_m.push_back(0.001f * static_cast<float>(i % 97));
    fired.labels.push_back(static_cast<std::uint16_t>(i % 89));
    fired.origins_m.emplace_back(0.001 * static_cast<double>(i % 7), 0, 0);
  }
  const OrganisedScan scan = organise(fired).scan;
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    EXPECT_EQ(scan.sd_m[i], fired.sd_m[scan.returns[i]]);
    EXPECT_EQ(scan.labels[i], fired.labels[scan.returns[i]]);
    EXPECT_EQ(scan.origins_m[i], fired.origins_m[scan.returns[i]]);
  }
}

TEST(OrganisedScan, FaultyTablesAreRefusedWithAllFaults) {
  ScanReturns table{.p_S = {{1, 0, 0}, {2, 0, 0}}, .rings = {1}, .sd_m = {-1, 0}};
  try {
    organise(table, ReturnChoice::Strongest);
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(),
                AllOf(HasSubstr("rings has 1 values; it must have 2"),
                      HasSubstr("intensity is not given"), HasSubstr("sd_m of row 0 = -1")));
  }
  table = {.p_S = {{1, 0, 0}, {2, 0, 0}}, .rings = {0, 1}, .columns = {0, 2'000'000'000}};
  EXPECT_THROW(organise(table), Error);
  table = {.p_S = {{1, 0, 0}, {2, 0, 0}}, .rings = {-2'000'000'000, 2'000'000'000}};
  EXPECT_THROW(organise(table, ReturnChoice::Last, RowOrder::Number), Error);
}

TEST(OrganisedScan, TimesOfAnyKindDoNoHarm) {
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

TEST(OrganisedScan, OnePosePlacesAScan) {
  const OrganisedScan scan = organise(seen({}, room)).scan;
  const Pose X_DS{rotation_from_yaw_pitch_roll(1, 0.2, -0.1), {100, -50, 3}};
  const OrganisedScan placed = place(scan, X_DS);
  for (std::size_t i = 0; i < scan.points_m.size(); ++i) {
    EXPECT_EQ(placed.points_m[i], X_DS * scan.points_m[i]);
    EXPECT_EQ(placed.origins_m[i], X_DS.translation_m);
  }
}

// A sensor that turns and moves at constant rates along a circle looks at points that are known in
// D: p_S is where each lies for the sensor as it fires.
TEST(OrganisedScan, EachPulseHasItsOwnPose) {
  const auto pose_at = [](double t) {
    return Pose{rotation_from_yaw_pitch_roll(0.5 * t, 0, 0),
                {20 * std::sin(0.5 * t), -20 * std::cos(0.5 * t), 1.9}};
  };
  const Trajectory X_DS(
      {{std::chrono::seconds(7), pose_at(0)}, {std::chrono::seconds(8), pose_at(1)}});
  ScanReturns fired = seen({}, room);
  std::vector<glm::dvec3> p_D;
  for (std::size_t i = 0; i < fired.p_S.size(); ++i) {
    fired.times_s.push_back(0.1 + fired.columns[i] * 1e-4);
    p_D.push_back(fired.p_S[i] + glm::dvec3(3, 4, 5));
    fired.p_S[i] = inverse(pose_at(fired.times_s[i])) * p_D[i];
  }
  const OrganisedScan scan = organise(fired).scan;
  const OrganisedScan placed = place(scan, X_DS, std::chrono::seconds(7), fired.times_s);
  for (std::size_t i = 0; i < placed.points_m.size(); ++i) {
    const std::uint32_t row = placed.returns[i];
    if (row == OrganisedScan::none) continue;
    EXPECT_LT(glm::distance(placed.points_m[i], p_D[row]), 1e-8);
    EXPECT_LT(glm::distance(placed.origins_m[i], pose_at(fired.times_s[row]).translation_m), 1e-8);
  }
  EXPECT_THROW(place(scan, X_DS, std::chrono::seconds(8), fired.times_s), Error);
  fired.times_s.pop_back();
  EXPECT_THROW(place(scan, X_DS, std::chrono::seconds(7), fired.times_s), Error);
  OrganisedScan stray = scan;
  stray.returns.clear();
  EXPECT_THROW(place(stray, X_DS, std::chrono::seconds(7), fired.times_s), Error);
}

}  // namespace
}  // namespace groundray
