#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <map>
#include <numbers>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/geometry/height_grid.h"
#include "terrain/scatter/scatter.h"
#include "test/support/terrain/shuffled_runner.h"

namespace groundray::rows_test {
namespace {

using ::testing::HasSubstr;
using testing::shuffled_runner;
using ::testing::ThrowsMessage;

// Level square centred on D's origin.
HeightGrid level(double side_m) {
  return {{2, 2}, {-side_m / 2, side_m / 2}, {side_m, -side_m}, {0, 0, 0, 0}};
}

std::vector<Placement> planted(double side_m, const Rows& rows, std::optional<double> per_m2 = {},
                               glm::dvec2 origin_w_m = {}, const PassRunner& runner = {}) {
  const ScatterSpec spec{.layer = 3, .rows = rows, .origin_w_m = origin_w_m};
  const DensityMap density(per_m2.value_or(1 / (rows.between_m * rows.within_m)));
  return Scatter(level(side_m), density, spec, Seed{5}).placements({}, runner);
}

// Sites at multiples of 3 m in x and of 2 m in y, for rows that run north.
TEST(Rows, AreALatticeFixedInTheWorld) {
  const auto all = planted(121, {.between_m = 3, .within_m = 2}, {}, {400000.5, 5000001});
  EXPECT_EQ(all.size(), 40 * 60);  // x from -58.5 to 58.5, y from -59 to 59
  for (const Placement& plant : all) {
    ASSERT_NEAR(std::remainder(plant.p_DO.x + 400000.5, 3), 0, 1e-9);
    ASSERT_NEAR(std::remainder(plant.p_DO.y + 5000001, 2), 0, 1e-9);
  }
}

TEST(Rows, RunAlongTheirAzimuth) {
  const double azimuth_rad = 30 * std::numbers::pi / 180;
  const glm::dvec2 along(std::sin(azimuth_rad), std::cos(azimuth_rad));
  const glm::dvec2 across(along.y, -along.x);
  const auto all = planted(100, {.between_m = 2.5, .within_m = 1.25, .azimuth_deg = 30});
  // The number of points of a lattice in a square is its area times their density, except for some
  // on its border.
  EXPECT_NEAR(static_cast<double>(all.size()), 1e4 / (2.5 * 1.25), 400 / 1.25);
  for (const Placement& plant : all) {
    const glm::dvec2 p(plant.p_DO);
    ASSERT_NEAR(std::remainder(glm::dot(p, along), 1.25), 0, 1e-9);
    ASSERT_NEAR(std::remainder(glm::dot(p, across), 2.5), 0, 1e-9);
  }
}

TEST(Rows, DoNotDependOnAreaOriginOrThreads) {
  const Rows rows{.between_m = 2.2, .within_m = 1.1, .azimuth_deg = 57, .jitter_m = 0.3};
  const auto whole = planted(200, rows, 0.3);
  EXPECT_EQ(whole, planted(200, rows, 0.3, {}, shuffled_runner(Seed{1})));
  std::map<std::uint64_t, glm::dvec2> known;
  for (const Placement& plant : whole) known[plant.key] = glm::dvec2(plant.p_DO);
  EXPECT_EQ(known.size(), whole.size());
  const glm::dvec2 moved(31, -17);
  const auto part = planted(80, rows, 0.3, moved);
  const auto in_part = [&](const Placement& plant) {
    const glm::dvec2 p = glm::abs(glm::dvec2(plant.p_DO) - moved);
    return std::max(p.x, p.y) <= 40;
  };
  EXPECT_EQ(part.size(), std::ranges::count_if(whole, in_part));
  for (const Placement& plant : part) {
    ASSERT_TRUE(known.contains(plant.key));
    ASSERT_LE(glm::length(glm::dvec2(plant.p_DO) + moved - known[plant.key]), 1e-9);
  }
}

// The count is binomial, the moves are uniform: within five standard deviations.
TEST(Rows, ArePlantedAndMovedAtRandom) {
  const Rows rows{.between_m = 2, .within_m = 2, .jitter_m = 0.5};
  const auto all = planted(401, rows, 0.25 / 4);
  const double sites = 200 * 200;
  EXPECT_NEAR(static_cast<double>(all.size()), sites / 4, 5 * std::sqrt(sites * 0.25 * 0.75) + 200);
  glm::dvec2 sum(0), squares(0);
  for (const Placement& plant : all) {
    const glm::dvec2 p(plant.p_DO);
    const glm::dvec2 off_m = p - 2.0 * glm::round(p / 2.0);
    ASSERT_LE(std::max(std::abs(off_m.x), std::abs(off_m.y)), 0.5);
    sum += off_m;
    squares += off_m * off_m;
  }
  const auto count = static_cast<double>(all.size());
  const double error_m = 5 * std::sqrt(1 / 12.0 / count);
  for (glm::length_t axis = 0; axis < 2; ++axis) {
    EXPECT_NEAR(sum[axis] / count, 0, error_m);
    EXPECT_NEAR(squares[axis] / count, 1 / 12.0, 5 * std::sqrt(1 / 180.0 / count));
  }
}

TEST(Rows, MistakesAreNamed) {
  const auto fails_with = [](const Rows& rows, const char* message) {
    EXPECT_THAT([&] { planted(50, rows, 0.1); }, ThrowsMessage<Error>(HasSubstr(message)));
  };
  fails_with({.between_m = 0}, "rows: spacing_m = [0, 1] must be positive and finite");
  fails_with({.jitter_m = 0.6},
             "rows: jitter_m = 0.6 must be from 0 to half of the smaller spacing");
  fails_with({.between_m = 10, .within_m = 10},
             "a density of 0.1 plants per m2 is more than rows with sites 10 x 10 m apart have");
  const ScatterSpec spec{.min_distance_m = 1, .rows = Rows{}};
  EXPECT_THAT([&] { Scatter(level(50), DensityMap(1), spec, Seed{5}); },
              ThrowsMessage<Error>(HasSubstr("min_distance_m = 1 has no meaning in rows")));
}

}  // namespace
}  // namespace groundray::rows_test
