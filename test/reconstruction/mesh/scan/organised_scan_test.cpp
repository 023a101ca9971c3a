#include "reconstruction/mesh/scan/organised_scan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "core/error.h"
#include "test/support/scans/beam_fan.h"
#include "test/support/scans/organised_cells.h"

namespace groundray::organised_scan_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)
using Random = std::mt19937_64;

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

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

TEST(OrganisedScan, KeepsOneReturnPerPulse) {
  const ScanReturns nearest = seen({}, [](const glm::dvec3&) { return 5.; });
  ScanReturns both = nearest;
  both.intensity.assign(both.p_S.size(), 1);
  for (std::size_t i = 0; i < nearest.p_S.size(); ++i) {  // two more each, farthest in the middle
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

TEST(OrganisedScan, CountsRowsWithoutAReturn) {
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

TEST(OrganisedScan, NoReturnsMakeAnEmptyGrid) {
  for (const ScanReturns& table :
       {ScanReturns{}, ScanReturns{.p_S = {glm::dvec3(nan)}},
        ScanReturns{.p_S = {glm::dvec3(0)}, .rings = {3}, .columns = {7}, .times_s = {1}}}) {
    const auto made = organise(table);
    EXPECT_EQ(made.scan.rows * made.scan.columns, 0);
    EXPECT_EQ(made.scan.points_m.size(), 0u);
    EXPECT_EQ(made.counts.no_returns, table.p_S.size());
  }
}

TEST(OrganisedScan, AcceptsFewReturns) {
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

TEST(OrganisedScan, KeepsTheAttributesOfReturns) {
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

TEST(OrganisedScan, ReportsAllFaultsOfATable) {
  ScanReturns table{.p_S = {{1, 0, 0}, {2, 0, 0}}, .rings = {1}, .sd_m = {-1, 0}};
  try {
    organise(table, ReturnChoice::Strongest);
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(),
                AllOf(HasSubstr("rings has 1 values; it must have 2"),
                      HasSubstr("there is no intensity"), HasSubstr("sd_m of row 0 = -1")));
  }
  table = {.p_S = {{1, 0, 0}, {2, 0, 0}}, .rings = {0, 1}, .columns = {0, 2'000'000'000}};
  EXPECT_THROW(organise(table), Error);
  table = {.p_S = {{1, 0, 0}, {2, 0, 0}}, .rings = {-2'000'000'000, 2'000'000'000}};
  EXPECT_THROW(organise(table, ReturnChoice::Last, RowOrder::Number), Error);
}

TEST(OrganisedScan, OnePoseTransformsAScan) {
  const OrganisedScan scan = organise(seen({}, room)).scan;
  const Pose X_DS{rotation_from_yaw_pitch_roll(1, 0.2, -0.1), {100, -50, 3}};
  const OrganisedScan placed = place(scan, X_DS);
  for (std::size_t i = 0; i < scan.points_m.size(); ++i) {
    EXPECT_EQ(placed.points_m[i], X_DS * scan.points_m[i]);
    EXPECT_EQ(placed.origins_m[i], X_DS.translation_m);
  }
}

// A sensor that turns and moves at constant rates along a circle observes points that are known in
// D: p_S is each point's position in S when its pulse fires.
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
    p_D.push_back(pose_at(0.1) * fired.p_S[i]);
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
}  // namespace groundray::organised_scan_test
