#include "apps/golden/compare/scans/scan_pairing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <tuple>

#include "apps/golden/compare/scans/pulses.h"
#include "test/support/scans/sample_scan.h"

namespace groundray::golden::scan_pairing_test {
namespace {

using groundray::testing::direction_of;
using groundray::testing::sample_returns;
using groundray::testing::SampleReturn;
using groundray::testing::SampleReturns;
using groundray::testing::scan_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double turn_rad = 2 * std::numbers::pi;

/// Returns with random directions, rings and times.
SampleReturns random_returns(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  SampleReturns returns(count);
  for (SampleReturn& r : returns) {
    r.direction = direction_of(turn_rad * unit(random), std::asin(2 * unit(random) - 1));
    r.range_m = 1 + 9 * unit(random);
    r.ring = std::floor(4 * unit(random));
    r.time_s = 0.1 * unit(random);
  }
  return returns;
}

/// Pairs by brute force: repeatedly the least of the remaining distances, up to `most`.
std::vector<std::pair<std::uint32_t, std::uint32_t>> brute_force(
    std::size_t references, std::size_t others, double most,
    const std::function<double(std::uint32_t, std::uint32_t)>& distance) {
  std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> all;
  for (std::uint32_t i = 0; i < references; ++i) {
    for (std::uint32_t j = 0; j < others; ++j) {
      if (distance(i, j) <= most) all.emplace_back(distance(i, j), i, j);
    }
  }
  std::ranges::sort(all);
  std::vector<bool> taken_i(references), taken_j(others);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const auto& [size, i, j] : all) {
    if (taken_i[i] || taken_j[j]) continue;
    taken_i[i] = taken_j[j] = true;
    pairs.emplace_back(i, j);
  }
  std::ranges::sort(pairs);
  return pairs;
}

TEST(DirectionTree, MatchesBruteForce) {
  std::vector<glm::dvec3> directions;
  for (const SampleReturn& r : random_returns(500, 1)) directions.push_back(r.direction);
  directions.push_back(directions[3]);
  const DirectionTree tree(directions);
  for (const SampleReturn& query : random_returns(100, 2)) {
    for (const double most_rad : {0.01, 0.1, 1., 4.}) {
      std::vector<std::uint32_t> found, expected;
      tree.for_each_within(query.direction, most_rad,
                           [&](std::uint32_t i, double) { found.push_back(i); });
      std::ranges::sort(found);
      double nearest_rad = std::numeric_limits<double>::infinity();
      for (std::uint32_t i = 0; i < directions.size(); ++i) {
        const double angle_rad = angle_between(query.direction, directions[i]);
        if (angle_rad <= most_rad) expected.push_back(i);
        if (angle_rad > most_rad) nearest_rad = std::min(nearest_rad, angle_rad);
      }
      EXPECT_EQ(found, expected);
      EXPECT_EQ(tree.nearest_beyond(query.direction, most_rad), nearest_rad);
    }
  }
}

TEST(PairScans, PairsDirectionsLikeBruteForce) {
  for (const double tolerance_rad : {0.02, 0.1, 0.3}) {
    const Scan a = scan_of(random_returns(300, 3), {}), b = scan_of(random_returns(250, 4), {});
    const Pairs pairs = pair_scans(a, b, {.tolerance_rad = tolerance_rad});
    EXPECT_EQ(pairs.rule, PairingRule::Direction);
    EXPECT_EQ(pairs.returns, brute_force(300, 250, tolerance_rad, [&](auto i, auto j) {
                return angle_between(a.p_S[i], b.p_S[j]);
              }));
    EXPECT_EQ(pairs.missing.size(), 300 - pairs.returns.size());
    EXPECT_EQ(pairs.extra.size(), 250 - pairs.returns.size());
  }
}

TEST(PairScans, PairsTimesAndAzimuthsOfARingLikeBruteForce) {
  const Scan a = scan_of(random_returns(300, 5), {"ring", "time"});
  const Scan b = scan_of(random_returns(250, 6), {"ring", "time"});
  const auto if_same_ring = [&](std::uint32_t i, std::uint32_t j, double distance) {
    const bool is_same = (*a.find(Quantity::Ring))[i] == (*b.find(Quantity::Ring))[j];
    return is_same ? distance : std::numeric_limits<double>::infinity();
  };
  const Pairs by_time = pair_scans(a, b, {.tolerance_s = 1e-3});
  EXPECT_EQ(by_time.rule, PairingRule::RingTime);
  EXPECT_EQ(by_time.returns, brute_force(300, 250, 1e-3, [&](auto i, auto j) {
              return if_same_ring(
                  i, j, std::abs((*a.find(Quantity::Time))[i] - (*b.find(Quantity::Time))[j]));
            }));
  const Pairs by_azimuth =
      pair_scans(a, b, {.rule = PairingRule::RingAzimuth, .tolerance_rad = 0.05});
  EXPECT_EQ(by_azimuth.returns, brute_force(300, 250, 0.05, [&](auto i, auto j) {
              const glm::dvec3 p = a.p_S[i], q = b.p_S[j];
              const double step = std::atan2(q.y, q.x) - std::atan2(p.y, p.x);
              return if_same_ring(i, j, std::abs(std::remainder(step, turn_rad)));
            }));
}

TEST(PairScans, DefaultToleranceIsHalfTheSpacing) {
  const SampleReturns returns = sample_returns();
  const auto tolerance_with = [&](const std::vector<std::string>& names) {
    return pair_scans(scan_of(returns, names), scan_of(returns, names), {}).tolerance;
  };
  EXPECT_NEAR(tolerance_with({"ring", "time"}), 1e-3 / 2, 1e-12);
  EXPECT_NEAR(tolerance_with({"ring"}), turn_rad / 90 / 2, 1e-12);
  EXPECT_NEAR(tolerance_with({}), 0.03 / 2, 1e-12);  // half of the spacing between rings
}

TEST(PairScans, ReportsWhyTimesAreNotUsed) {
  SampleReturns later = sample_returns();
  for (SampleReturn& r : later) r.time_s += 1.6e9;
  const Scan reference = scan_of(sample_returns(), {"ring", "time"});
  const Pairs apart = pair_scans(reference, scan_of(later, {"ring", "time"}), {});
  EXPECT_EQ(apart.rule, PairingRule::RingAzimuth);
  EXPECT_THAT(apart.notes, ElementsAre(AllOf(HasSubstr("Their times do not overlap"),
                                             HasSubstr("(--time-zero-s)"))));
  for (SampleReturn& r : later) r.time_s = 0;
  const Pairs alike = pair_scans(reference, scan_of(later, {"ring", "time"}), {});
  EXPECT_EQ(alike.rule, PairingRule::RingAzimuth);
  EXPECT_THAT(alike.notes, ElementsAre(HasSubstr("do not distinguish its pulses")));
  EXPECT_EQ(alike.returns.size(), 720u);
}

TEST(PairScans, PairsByPulseNumberIfBothHaveIt) {
  SampleReturns returns = sample_returns();
  auto reference_file = groundray::testing::file_of(returns, {});
  auto other_file = groundray::testing::file_of(returns, {});
  const auto a = reference_file.cloud.add<std::uint32_t>("pulse");
  const auto b = other_file.cloud.add<std::uint32_t>("pulse");
  for (std::uint32_t i = 0; i < returns.size(); ++i) {
    a[i] = i;
    b[i] = i + 1;
  }
  const Pairs pairs = pair_scans(groundray::scan_of(reference_file, "a", {}),
                                 groundray::scan_of(other_file, "b", {}), {});
  EXPECT_EQ(pairs.rule, PairingRule::Pulse);
  ASSERT_EQ(pairs.returns.size(), 719u);
  EXPECT_EQ(pairs.returns[0], std::pair(1U, 0U));
  EXPECT_THAT(pairs.missing, ElementsAre(0U));
  EXPECT_THAT(pairs.extra, ElementsAre(719U));
}

TEST(Pulses, GroupReturnsByDirectionRingAndTime) {
  SampleReturns returns(5);
  returns[0] = {.direction = direction_of(1, 0), .range_m = 5};
  returns[1] = {.direction = direction_of(1 + 0.5 * same_pulse_rad, 0), .range_m = 7};
  returns[2] = {.direction = direction_of(1 + 2 * same_pulse_rad, 0), .range_m = 7};
  returns[3] = {.direction = direction_of(1, 0), .range_m = 9, .ring = 1};
  returns[4] = {.direction = direction_of(2, 0), .range_m = 9, .ring = 1, .time_s = 1};
  EXPECT_EQ(pulses_of(scan_of(returns, {})).size(), 3u);
  EXPECT_EQ(pulses_of(scan_of(returns, {"ring"})).size(), 4u);
  const Pulses pulses = pulses_of(scan_of(returns, {"ring", "time"}));  // direction is ignored
  ASSERT_EQ(pulses.size(), 3u);
  EXPECT_THAT(pulses.of(0), ElementsAre(0U, 1U, 2U));
  EXPECT_THAT(pulses.of(1), ElementsAre(3U));
  EXPECT_THAT(pulses.rings, ElementsAre(0, 1, 1));
  EXPECT_THAT(pulses_of(scan_of({}, {})).returns, IsEmpty());
}

// A return joins a pulse if it is near the pulse's first return; being near a later one is not
// enough.
TEST(Pulses, DoNotChainNeighbouringReturns) {
  SampleReturns returns;
  for (const double step : {0., 0.9, 1.8, 2.7, 0.1})
    returns.push_back({.direction = direction_of(1 + step * same_pulse_rad, 0), .range_m = 5});
  const Pulses pulses = pulses_of(scan_of(returns, {}));
  ASSERT_EQ(pulses.size(), 2u);
  EXPECT_THAT(pulses.of(0), ElementsAre(0U, 1U, 4U));
  EXPECT_THAT(pulses.of(1), ElementsAre(2U, 3U));
}

TEST(Pulses, GroupReturnsLikeBruteForce) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(0, 10 * same_pulse_rad);
  SampleReturns returns(400);
  for (SampleReturn& r : returns) {
    r = {.direction = direction_of(1 + unit(random), unit(random)), .range_m = 5};
    r.ring = std::floor(2 * unit(random) / (10 * same_pulse_rad));
  }
  const Scan scan = scan_of(returns, {"ring"});
  std::vector<std::vector<std::uint32_t>> expected;
  for (std::uint32_t i = 0; i < returns.size(); ++i) {
    const auto joined = std::ranges::find_if(expected, [&](const auto& pulse) {
      return returns[pulse[0]].ring == returns[i].ring &&
             angle_between(scan.p_S[pulse[0]], scan.p_S[i]) <= same_pulse_rad;
    });
    if (joined != expected.end()) {
      joined->push_back(i);
    } else {
      expected.push_back({i});
    }
  }
  const Pulses pulses = pulses_of(scan);
  ASSERT_EQ(pulses.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k)
    EXPECT_THAT(pulses.of(k), ::testing::ElementsAreArray(expected[k]));
}

// Comparing all pairs would take minutes; the limit is a hundred times the expected duration.
TEST(PairScans, PairsAStationaryBeamQuickly) {
  SampleReturns returns(60'000);
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const auto number = static_cast<double>(i);
    returns[i] = {.direction = direction_of(1, 0), .range_m = 5 + 1e-3 * number};
    returns[i].time_s = 1e-6 * number;
  }
  const auto start = std::chrono::steady_clock::now();
  const Scan still = scan_of(returns, {});
  EXPECT_EQ(pair_scans(still, still, {}).returns.size(), returns.size());
  EXPECT_EQ(pulses_of(scan_of(returns, {"time"})).size(), returns.size());
  const Scan pulsed = scan_of(returns, {"ring", "time"});
  EXPECT_EQ(pair_scans(pulsed, pulsed, {}).returns.size(), returns.size());
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

}  // namespace
}  // namespace groundray::golden::scan_pairing_test
