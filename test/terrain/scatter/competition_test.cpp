// Competition against its definition by a search of all pairs, and against random sequential
// adsorption, whose coverage is known.
#include "terrain/scatter/competition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "terrain/scatter/dart_field.h"
#include "terrain/scatter/scatter.h"

namespace groundray::competition_test {
namespace {

std::vector<Contender> forest(std::uint32_t seed, std::size_t count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> at_m(0, 60), height_m(1, 20), share(0, 1);
  std::vector<Contender> plants;
  for (std::size_t i = 0; i < count; ++i) {
    Contender plant;
    plant.p_m.x = at_m(random);
    plant.p_m.y = at_m(random);
    plant.height_m = std::round(height_m(random));  // so that some are equally high
    plant.species = i % 3 == 0 ? 7 : 2;
    plant.zone_m = (i % 3 == 0 ? 0.15 : 0.3) * plant.height_m;
    plant.tolerance = i % 3 == 0 ? 0.8 : 0.1;
    plant.min_distance_m = 0.5;
    plant.key = i;
    plants.push_back(plant);
  }
  return plants;
}

bool is_taller(const Contender& a, const Contender& b) {
  if (a.height_m != b.height_m) return a.height_m > b.height_m;
  return a.species != b.species ? a.species < b.species : a.key < b.key;
}

bool is_too_near(const Contender& plant, const Contender& taller) {
  const double apart_m = glm::distance(plant.p_m, taller.p_m);
  return apart_m < plant.min_distance_m || apart_m < taller.min_distance_m ||
         apart_m < (1 - plant.tolerance) * (plant.zone_m + taller.zone_m);
}

// The definition has one solution: it is checked for each plant, given the others.
TEST(Competition, APlantSurvivesUnlessATallerSurvivorIsTooNear) {
  const std::vector<Contender> plants = forest(3, 2000);
  const std::vector<std::size_t> found = survivors(plants);
  EXPECT_TRUE(std::ranges::is_sorted(found));
  const std::set<std::size_t> standing(found.begin(), found.end());
  EXPECT_GT(standing.size(), 100u);
  EXPECT_LT(standing.size(), 1000u);
  for (std::size_t i = 0; i < plants.size(); ++i) {
    const bool has_to_yield = std::ranges::any_of(standing, [&](std::size_t j) {
      return is_taller(plants[j], plants[i]) && is_too_near(plants[i], plants[j]);
    });
    EXPECT_NE(standing.contains(i), has_to_yield) << i;
  }
}

TEST(Competition, SurvivorsDoNotDependOnTheOrderOfPlants) {
  std::vector<Contender> plants = forest(4, 1500);
  const auto keys = [&] {
    std::set<std::uint64_t> found;
    for (const std::size_t i : survivors(plants)) found.insert(plants[i].key);
    return found;
  };
  const auto before = keys();
  std::ranges::shuffle(plants, std::mt19937(1));
  EXPECT_EQ(keys(), before);
}

// Far plants do not matter: inside of a window that is wider by 8 of the largest zones' diameters,
// the survivors are those of the whole.
TEST(Competition, NeighboursDecide) {
  const std::vector<Contender> plants = forest(5, 3000);
  const auto is_within = [](const Contender& plant, double half_m) {
    return std::abs(plant.p_m.x - 30) < half_m && std::abs(plant.p_m.y - 30) < half_m;
  };
  std::set<std::uint64_t> whole, part;
  for (const std::size_t i : survivors(plants)) {
    if (is_within(plants[i], 5)) whole.insert(plants[i].key);
  }
  std::vector<Contender> near;
  std::ranges::copy_if(plants, std::back_inserter(near),
                       [&](const Contender& plant) { return is_within(plant, 28); });
  ASSERT_LT(near.size(), plants.size());
  for (const std::size_t i : survivors(near)) {
    if (is_within(near[i], 5)) part.insert(near[i].key);
  }
  EXPECT_FALSE(whole.empty());
  EXPECT_EQ(part, whole);
}

TEST(Competition, ShadeTolerantPlantsGrowBelowOthers) {
  const Contender oak{.height_m = 20, .zone_m = 6};
  Contender yew{.p_m = {1, 0}, .height_m = 3, .zone_m = 1, .tolerance = 0};
  EXPECT_EQ(survivors(std::vector{yew, oak}), (std::vector<std::size_t>{1}));
  yew.tolerance = 0.9;  // 0.7 m are enough
  EXPECT_EQ(survivors(std::vector{yew, oak}), (std::vector<std::size_t>{0, 1}));
  yew.min_distance_m = 1.5;
  EXPECT_EQ(survivors(std::vector{yew, oak}), (std::vector<std::size_t>{1}));
}

// Plants of equal zones and different heights are random sequential adsorption of discs, with the
// height as the order of arrival: `thrown_for` returns the plants that lead to a coverage.
TEST(Competition, EqualZonesGiveTheCoverageOfSequentialAdsorption) {
  constexpr double coverage = 0.4, zone_m = 0.5, side_m = 200;
  const double disc_m2 = std::numbers::pi * zone_m * zone_m;
  std::mt19937 random(11);
  const double mean = thrown_for(coverage) / disc_m2 * side_m * side_m;
  const auto count = std::poisson_distribution<int>(mean)(random);
  std::uniform_real_distribution<double> at_m(0, side_m), height_m(1, 20);
  std::vector<Contender> plants;
  for (int i = 0; i < count; ++i) {
    Contender plant{.zone_m = zone_m};
    plant.p_m.x = at_m(random);
    plant.p_m.y = at_m(random);
    plant.height_m = height_m(random);
    plants.push_back(plant);
  }
  double inside = 0;
  for (const std::size_t i : survivors(plants)) {
    const glm::dvec2 p_m = plants[i].p_m;
    inside += std::min(p_m.x, p_m.y) > 5 && std::max(p_m.x, p_m.y) < side_m - 5 ? 1 : 0;
  }
  // Counts vary by a fraction of the Poisson deviation of 0.7 %; the edge is left out.
  EXPECT_NEAR(inside * disc_m2 / std::pow(side_m - 10, 2), coverage, 0.01 * coverage);
}

// From the distribution function, cut off at the upper end.
TEST(Weibull, QuantilesInvertTheDistribution) {
  const Interval range{2, 25};
  for (const Weibull& law : {Weibull{1, 6}, Weibull{3.6, 12}, Weibull{0.7, 100}}) {
    const auto below = [&](double x) {
      return 1 - std::exp(-std::pow((x - range.low) / law.scale, law.shape));
    };
    for (double share = 0; share <= 1; share += 0.125) {
      const double x = law.quantile(share, range);
      EXPECT_NEAR(below(x) / below(range.high), share, 1e-12) << law.shape;
    }
    EXPECT_EQ(law.quantile(0, range), range.low);
    EXPECT_NEAR(law.quantile(1, range), range.high, 1e-12);
  }
  EXPECT_EQ((Weibull{1, 5}.quantile(0.3, {4, 4})), 4);
}

}  // namespace
}  // namespace groundray::competition_test
