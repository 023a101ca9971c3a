#include "reconstruction/mesh/accuracy/vertical_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/vec3.hpp>
#include <random>
#include <vector>

#include "core/error.h"
#include "test/support/terrain/plan_check.h"

namespace groundray::vertical_error_test {
namespace {

const TriangleMesh slope{{{0, 0, 0}, {10, 0, 5}, {10, 10, 5}, {0, 10, 0}}, {{0, 1, 2}, {0, 2, 3}}};

// The slope is z = x / 2.
TEST(VerticalError, MatchesAPlane) {
  const std::vector<glm::dvec3> places_m{{2, 3, 1}, {4, 9, 3}, {6, 1, 1}, {8, 8, 4.5}};
  const VerticalError error = vertical_error(places_m, slope);  // 0, 1 above, 2 below, 0.5 above
  EXPECT_NEAR(error.largest_m, 2, 1e-14);
  EXPECT_NEAR(error.mean_m, 3.5 / 4, 1e-14);
  EXPECT_NEAR(error.rms_m, std::sqrt(5.25 / 4), 1e-14);
  EXPECT_EQ(error.aside_m, 0);
}

TEST(VerticalError, UsesTheNearestBorderPointOutsideTheMesh) {
  const VerticalError error = vertical_error({{13, 14, 9}}, slope);
  EXPECT_NEAR(error.aside_m, 5, 1e-14);
  EXPECT_NEAR(error.largest_m, 4, 1e-14);
}

// Oracle: exhaustive search over a surface of many triangles.
TEST(VerticalError, MatchesExhaustiveSearch) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(0, 20), height(-1, 1), shift(-0.3, 0.3);
  TriangleMesh rough;
  for (int row = 0; row <= 20; ++row) {
    for (int column = 0; column <= 20; ++column) {
      const double x = column + shift(random), y = row + shift(random);
      rough.vertices_m.emplace_back(x, y, height(random));
    }
  }
  for (unsigned row = 0; row < 20; ++row) {
    for (unsigned column = 0; column < 20; ++column) {
      const unsigned a = row * 21 + column, b = a + 1, c = a + 21, d = c + 1;
      rough.triangles.insert(rough.triangles.end(), {{a, b, c}, {b, d, c}});
    }
  }
  std::vector<glm::dvec3> places_m;
  for (int i = 0; i < 2000; ++i) {
    const double x = 0.5 + 0.95 * place(random), y = 0.5 + 0.95 * place(random);
    places_m.emplace_back(x, y, height(random));
  }
  const testing::PlanCheck check = testing::check_plan(places_m, rough);
  ASSERT_EQ(check.uncovered, 0u);
  const VerticalError error = vertical_error(places_m, rough);
  EXPECT_NEAR(error.largest_m, check.largest_m, 1e-12);
  EXPECT_NEAR(error.rms_m, check.rms_m, 1e-12);
  EXPECT_EQ(error.aside_m, 0);
}

// Two decks in either order; the upper one does not cover all of the lower one.
TEST(VerticalError, UsesTheNearestOfTwoStoreys) {
  for (const bool is_upper_first : {true, false}) {
    TriangleMesh decks = slope;  // z = x / 2
    for (const glm::dvec3& p_m : slope.vertices_m)
      decks.vertices_m.emplace_back(0.5 * p_m.x, p_m.y, 20 + p_m.z);  // z = 20 + x
    decks.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
    if (is_upper_first) std::reverse(decks.triangles.begin(), decks.triangles.end());
    const auto distances =
        vertical_distances({{2, 3, 1.5}, {2, 7, 21}, {2, 3, 9}, {8, 3, 18}}, decks);
    const double expected_m[] = {0.5, 1, 8, 14};
    for (std::size_t i = 0; i < distances.size(); ++i) {
      EXPECT_NEAR(distances[i].above_m, expected_m[i], 1e-13) << i;
      EXPECT_EQ(distances[i].aside_m, 0) << i;
    }
    // Beyond the borders of both decks, and of the upper one alone.
    const auto beyond = vertical_distances({{-1, 5, 19}, {-1, 5, 1}, {12, 5, 24}}, decks);
    EXPECT_NEAR(beyond[0].above_m, 1, 1e-13);
    EXPECT_NEAR(beyond[1].above_m, 1, 1e-13);
    EXPECT_NEAR(beyond[2].above_m, 19, 1e-13);
    EXPECT_NEAR(beyond[2].aside_m, 2, 1e-13);
  }
}

TEST(VerticalError, RejectsEmptyMeshes) { EXPECT_THROW(vertical_error({{0, 0, 0}}, {}), Error); }

}  // namespace
}  // namespace groundray::vertical_error_test
