#include "reconstruction/dem/thin_plate/ldlt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <random>
#include <vector>

#include "core/error.h"
#include "test/reconstruction/dem/difference_plate.h"

namespace groundray::ldlt_test {
namespace {

using testing::difference_plate;
using testing::DifferencePlate;

std::vector<double> random_values(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> values(count);
  std::ranges::generate(values, [&] { return normal(random); });
  return values;
}

// Raster with very ragged holes.
std::vector<glm::ivec2> ragged_places() {
  std::mt19937 random(1);
  std::vector<glm::ivec2> places;
  for (int row = 0; row < 60; ++row)
    for (int column = 0; column < 90; ++column)
      if (column % 17 < 3 || row % 23 < 5 || random() % 3 == 0) places.emplace_back(column, row);
  return places;
}

TEST(NestedDissection, SeparatesTheHalves) {
  const auto places = ragged_places();
  for (const int reach : {1, 2, 3}) {
    const Dissection found = dissect(places, reach);
    std::vector<std::int32_t> all(places.size());
    std::iota(all.begin(), all.end(), 0);
    EXPECT_TRUE(std::ranges::is_permutation(found.order, all));
    // Ancestors of each sample's part: the parts with which it may share an equation.
    std::vector<std::size_t> parents(found.parts.size(), found.parts.size()), part_of(all.size());
    for (std::size_t k = 0; k < found.parts.size(); ++k) {
      for (const std::size_t child : found.parts[k].children) parents[child] = k;
      for (std::size_t i = found.parts[k].begin; i < found.parts[k].end; ++i)
        part_of[static_cast<std::size_t>(found.order[i])] = k;
    }
    const auto leads_to = [&](std::size_t from, std::size_t to) {
      while (from < to) from = parents[from];
      return from == to;
    };
    for (std::size_t a = 0; a < places.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        const glm::ivec2 apart = places[a] - places[b];
        if (std::max(std::abs(apart.x), std::abs(apart.y)) > reach) continue;
        EXPECT_TRUE(leads_to(part_of[a], part_of[b]) || leads_to(part_of[b], part_of[a]));
      }
    }
  }
}

// Oracle: substitutes the solution into the equations.
TEST(LdltFactor, SolvesAfterUnknownsAreExcluded) {
  for (const int order : {1, 2, 3}) {
    const DifferencePlate plate = difference_plate({70, 50}, order);
    const std::size_t count = plate.matrix.size();
    const Dissection dissection = dissect(plate.places, order);
    const auto right = random_values(count, 2);
    LdltFactor factor(plate.matrix, dissection, FactorUse::Changing);
    std::mt19937 random(3);
    std::vector<std::uint8_t> is_out(count);
    for (int round = 0; round < 8; ++round) {
      factor.factorise(is_out);
      const auto z = factor.solve(right);
      const auto found = plate.matrix.times(z);
      for (std::size_t i = 0; i < count; ++i) {
        if (is_out[i] != 0) {
          EXPECT_EQ(z[i], 0);
        } else {
          EXPECT_NEAR(found[i], right[i], 1e-9);  // heights are up to 1e3
        }
      }
      LdltFactor anew(plate.matrix, dissection, FactorUse::Once);
      anew.factorise(is_out);
      EXPECT_EQ(anew.solve(right), z);
      for (unsigned change = 0; change < (round % 2 == 0 ? 600u : 3u); ++change)
        is_out[random() % count] ^= 1;
    }
  }
}

TEST(LdltFactor, RejectsSingularEquations) {
  ThinPlateMatrix matrix{.ends = {1, 2}, .samples = {0, 1}, .factors = {1, 0}};
  const std::vector<glm::ivec2> places{{0, 0}, {1, 0}};
  const Dissection dissection = dissect(places, 1);
  LdltFactor factor(matrix, dissection, FactorUse::Once);
  EXPECT_THROW(factor.factorise(std::vector<std::uint8_t>(2)), Error);
}

}  // namespace
}  // namespace groundray::ldlt_test
