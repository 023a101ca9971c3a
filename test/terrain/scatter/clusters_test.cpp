#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/geometry/height_grid.h"
#include "terrain/scatter/cluster_field.h"
#include "terrain/scatter/scatter.h"
#include "test/support/terrain/shuffled_runner.h"

namespace groundray::clusters_test {
namespace {

using std::numbers::pi;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::shuffled_runner;
using testing::threaded_runner;
using ::testing::ThrowsMessage;

// Level square centred on D's origin.
HeightGrid level(double side_m) {
  return {{2, 2}, {-side_m / 2, side_m / 2}, {side_m, -side_m}, {0, 0, 0, 0}};
}

ScatterSpec clustered(double size_m, double contrast) {
  return {.layer = 3, .clusters = Clusters{size_m, contrast}};
}

std::vector<Placement> plants(double side_m, double per_m2, const ScatterSpec& spec,
                              std::uint64_t seed = 5) {
  return Scatter(level(side_m), DensityMap(per_m2), spec, Seed{seed}).placements();
}

// A cluster of the integral 1 about its point, in units of cells: the equation of
// docs/reference/scatter.md.
double bump(glm::dvec2 off) {
  const double inside = std::max(0.0, 1 - glm::dot(off, off) * 16 / 9);
  return 16 / (3 * pi) * inside * inside;
}

TEST(Clusters, ContrastOfZeroChangesNoPlant) {
  ScatterSpec spec{.layer = 3, .min_distance_m = 0.6, .scale = {1, 2}};
  const auto even = plants(100, 0.4, spec);
  spec.clusters = {4, 0};
  EXPECT_EQ(plants(100, 0.4, spec), even);
  EXPECT_GT(even.size(), 3000U);
}

// Over seeds, the field has mean 1 at any position. Standard errors are estimated from the same
// values; 4.5 of them are exceeded with a probability of 7e-6, 2e-4 over all 25 positions (Šidák).
// The variance and the share of ground without clusters, averaged over positions, are those of
// another program that scattered clusters on 400 x 400 cells; its standard errors, 0.02 and 0.003,
// are added to those here.
TEST(Clusters, FieldHasMeanOneAtEveryPosition) {
  constexpr int seeds = 8000, steps = 5;
  const double highest = 128 / (3 * pi);
  EXPECT_NEAR(ClusterField({2, 1}, {}, 0).highest(), highest, 1e-12);
  double all_squares = 0, fourths = 0, empty = 0;
  for (std::uint32_t k = 0; k < steps * steps; ++k) {
    const glm::dvec2 p = (glm::dvec2(k % steps, k / steps) + 0.5) * 2.0 / double{steps} + 600.0;
    double sum = 0, squares = 0;
    for (std::uint64_t seed = 0; seed < seeds; ++seed) {
      const double value = ClusterField({2, 1}, Seed{seed}, k).at(p);
      ASSERT_GE(value, 0);
      ASSERT_LE(value, highest);
      ASSERT_NEAR(ClusterField({2, 0.25}, Seed{seed}, k).at(p), 0.75 + 0.25 * value, 1e-12);
      sum += value;
      squares += value * value;
      fourths += std::pow(value, 4);
      empty += value < 1e-12 ? 1 : 0;
    }
    EXPECT_NEAR(sum / seeds, 1, 4.5 * std::sqrt((squares / seeds - 1) / seeds)) << k;
    all_squares += squares;
  }
  constexpr double n = double{seeds} * steps * steps;
  EXPECT_NEAR(all_squares / n - 1, 1.55, 4 * (0.02 + std::sqrt(fourths / n / n)));
  EXPECT_NEAR(empty / n, 0.35, 4 * (0.003 + std::sqrt(0.35 * 0.65 / n)));
}

// The number of plants in a square of n x n cells of a m has the variance rho A + rho^2 V, with V
// the variance of the field's integral. Clusters that lie inside contribute 0 or 2 a^2, i.e. a^4
// each; those of cells within one cell of the border contribute at most half of (2 a^2)^2. The mean
// over seeds is within 4.5 standard errors except for a probability of 7e-6; the documented error
// of 2e-4 is added.
TEST(Clusters, KeepTheNumberOfPlants) {
  constexpr int seeds = 48, n = 20;
  constexpr double size_m = 5, side_m = n * size_m, per_m2 = 0.3;
  for (const double contrast : {0.5, 1.0}) {
    for (const double min_distance_m : {0.0, 0.3}) {
      ScatterSpec spec = clustered(size_m, contrast);
      spec.min_distance_m = min_distance_m;
      double sum = 0;
      for (std::uint64_t seed = 0; seed < seeds; ++seed)
        sum += static_cast<double>(plants(side_m, per_m2, spec, 100 + seed).size());
      const double cells = (n - 2) * (n - 2), border = (n + 2) * (n + 2) - cells;
      const double field_m4 = contrast * contrast * std::pow(size_m, 4) * (cells + 2 * border);
      const double expected = per_m2 * side_m * side_m;
      const double variance = expected + per_m2 * per_m2 * field_m4;
      EXPECT_NEAR(sum / seeds, expected, 2e-4 * expected + 4.5 * std::sqrt(variance / seeds))
          << contrast << ", " << min_distance_m;
    }
  }
}

// Variance of the integral of the field over a cell, of side and contrast 1: the sum over the cells
// around it of the variances of their clusters' shares, by the midpoint rule.
double variance_over_a_cell() {
  constexpr int steps = 24;
  const auto midpoint = [](int i) {
    return (glm::dvec2(i % steps, i / steps) + 0.5) / double{steps};
  };
  double variance = 0;
  for (int cell = 0; cell < 9; ++cell) {
    double mean = 0, square = 0;  // of the share of a cluster that lies in the cell
    for (int i = 0; i < steps * steps; ++i) {
      const glm::dvec2 centre = midpoint(i) + glm::dvec2(cell % 3 - 1, cell / 3 - 1);
      double share = 0;
      for (int j = 0; j < steps * steps; ++j) share += bump(midpoint(j) - centre);
      share /= steps * steps;
      mean += share / (steps * steps);
      square += share * share / (steps * steps);
    }
    variance += 2 * square - mean * mean;  // 0 or 2, each with probability 1/2
  }
  return variance;
}

// Counts in every third cell are independent, because no cluster reaches two of them. Their mean is
// known, so that the mean square deviation estimates the variance, with a standard error that is
// estimated from the same counts: 4.5 of them, a probability of about 1e-5.
TEST(Clusters, CountsVaryAsPredicted) {
  constexpr double size_m = 4, per_m2 = 1, side_m = 360, mean = size_m * size_m * per_m2;
  constexpr int cells = 90;
  constexpr auto all_cells = static_cast<std::size_t>(cells) * cells;
  for (const double contrast : {0.0, 0.6, 1.0}) {
    double sum = 0, squares = 0, count = 0;
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      std::vector<double> counts(all_cells);
      for (const Placement& plant : plants(side_m, per_m2, clustered(size_m, contrast), seed)) {
        const glm::ivec2 cell(glm::floor((glm::dvec2(plant.p_DO) + side_m / 2) / size_m));
        if (std::max(cell.x, cell.y) < cells)
          ++counts[static_cast<std::size_t>(cell.y) * cells + static_cast<std::size_t>(cell.x)];
      }
      for (int i = 0; i < cells * cells; ++i) {
        if (i % cells % 3 != 1 || i / cells % 3 != 1) continue;
        const double off = counts[static_cast<std::size_t>(i)] - mean;
        sum += off * off;
        squares += off * off * off * off;
        ++count;
      }
    }
    const double variance = sum / count;
    const double error = std::sqrt((squares / count - variance * variance) / count);
    const double expected = mean + mean * mean * contrast * contrast * variance_over_a_cell();
    EXPECT_NEAR(variance, expected, 4.5 * error) << contrast;
    EXPECT_LT(error, 0.1 * expected);  // it must not hide a difference
    if (contrast == 1) {
      EXPECT_GT(expected, 10 * mean);
    }
  }
}

TEST(Clusters, DoNotDependOnAreaOriginOrThreads) {
  ScatterSpec spec = clustered(3, 0.8);
  spec.min_distance_m = 0.3;
  spec.origin_w_m = {500'003.25, 5'150'001.5};
  const Scatter scatter(level(200), DensityMap(0.3), spec, Seed{7});
  const auto whole = scatter.placements({}, threaded_runner(1));
  EXPECT_GT(whole.size(), 9000U);
  EXPECT_EQ(scatter.placements({}, threaded_runner(3)), whole);
  EXPECT_EQ(scatter.placements({}, shuffled_runner(Seed{9})), whole);
  std::map<std::uint64_t, Placement> known;
  for (const Placement& plant : whole) known[plant.key] = plant;
  const glm::dvec2 moved(31, -17);  // the ground is cut out, and has another origin
  const auto in_part = [&](const Placement& plant) {
    const glm::dvec2 p = glm::abs(glm::dvec2(plant.p_DO) - moved);
    return std::max(p.x, p.y) <= 40;
  };
  const auto some = scatter.placements({moved - 40., moved + 40.});
  EXPECT_EQ(some.size(), std::ranges::count_if(whole, in_part));
  spec.origin_w_m += moved;
  const auto part = Scatter(level(80), DensityMap(0.3), spec, Seed{7}).placements();
  ASSERT_EQ(part.size(), some.size());
  for (std::size_t i = 0; i < part.size(); ++i) {
    EXPECT_EQ(part[i].key, some[i].key);
    EXPECT_EQ(some[i], known[some[i].key]);
  }
}

// In a layer of another name or seed, clusters are elsewhere: with two fields of variance v, the
// mean of their product over n independent positions is 1, within sqrt(E[g^2]^2 / n) standard
// errors. Positions are two cells apart.
TEST(Clusters, OfOtherLayersAndSeedsAreIndependent) {
  const ClusterField field({1, 1}, Seed{1}, 1);
  for (const ClusterField& other :
       {ClusterField({1, 1}, Seed{1}, 2), ClusterField({1, 1}, Seed{2}, 1)}) {
    constexpr int n = 20'000;
    double sum = 0;
    for (int i = 0; i < n; ++i) {
      const glm::dvec2 p(3.0 * i + 0.37 * (i % 7), 0.41 * (i % 11));
      sum += field.at(p) * other.at(p);
    }
    EXPECT_NEAR(sum / n, 1, 4.5 * 2.55 / std::sqrt(n));
  }
}

TEST(Clusters, ErrorsReportEveryFault) {
  const auto plant = [](const ScatterSpec& spec, double per_m2) {
    return [=] { Scatter(level(10), DensityMap(per_m2), spec, Seed{1}); };
  };
  EXPECT_THAT(plant({.rows = Rows{}, .clusters = Clusters{0, 2}}, 1),
              ThrowsMessage<Error>(AllOf(HasSubstr("clusters: size_m = 0 must be positive"),
                                         HasSubstr("clusters: contrast = 2 must be from 0 to 1"),
                                         HasSubstr("clusters have no meaning in rows"))));
  EXPECT_THAT(
      plant({.clusters = Clusters{std::numeric_limits<double>::infinity(), 1}}, 1),
      ThrowsMessage<Error>(HasSubstr("clusters: size_m = inf must be positive and finite")));
  EXPECT_THAT(plant({.clusters = Clusters{1e-4, 1}, .origin_w_m = {5e5, 5e6}}, 1),
              ThrowsMessage<Error>(HasSubstr("clusters: cells of size_m = 0.0001 have indices")));
  // 128 / (3 pi) times 0.05 per m2 is 0.679; the greatest for 1 m is 0.45 / (pi / 4).
  EXPECT_THAT(plant({.min_distance_m = 1, .clusters = Clusters{2, 1}}, 0.05),
              ThrowsMessage<Error>(AllOf(HasSubstr("a density of 0.679"),
                                         HasSubstr("plants per m2, in clusters, is too high"),
                                         HasSubstr("at most 0.57296 per m2"))));
}

}  // namespace
}  // namespace groundray::clusters_test
