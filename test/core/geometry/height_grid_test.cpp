#include "core/geometry/height_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "core/error.h"
#include "test/support/terrain/reference_tracer.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::height_grid_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr float hole = std::numeric_limits<float>::quiet_NaN();

TEST(HeightGrid, CellIsSplitFromTheNextColumnToTheNextRow) {
  // Only the corner (1, 1) is raised: the near half stays flat, and on the far half height grows
  // with u + v - 1.
  const HeightGrid grid({2, 2}, {0, 0}, {1, 1}, {0, 0, 0, 8});
  EXPECT_EQ(grid.height_m_at({0.5, 0.5}), 0);
  EXPECT_EQ(grid.height_m_at({0.25, 0.5}), 0);
  EXPECT_EQ(grid.height_m_at({0.75, 0.5}), 2);
  EXPECT_EQ(grid.height_m_at({1, 1}), 8);
}

TEST(HeightGrid, HeightsMatchTheReferenceEverywhere) {
  const HeightGrid grid = testing::with_holes(testing::fractal(65, 3, 60, Seed{1}), 30, 4, Seed{2});
  for (std::uint32_t i = 0; i < 50'000; ++i) {
    const glm::dvec2 p = (random_uniform({Seed{3}, 0, 0, i}) - 0.5) * 220.0;
    const double expected = testing::reference_height_m(grid, p.x, p.y);
    const auto height_m = grid.height_m_at(p);
    ASSERT_EQ(height_m.has_value(), !std::isnan(expected)) << p.x << ' ' << p.y;
    if (!height_m) continue;
    ASSERT_NEAR(*height_m, expected, 1e-12 * 64);  // one or two ulps of 64 m, slopes below 10
  }
}

TEST(HeightGrid, NormalIsPerpendicularToTheFacetAndPointsUp) {
  const HeightGrid grid({2, 2}, {0, 0}, {2, -4}, {1, 3, 7, 2});  // rows run to the south
  const glm::dvec3 n = grid.frame().normal(grid.cell(0, 0).plane(Half::Near));
  EXPECT_NEAR(glm::dot(n, glm::dvec3(2, 0, 2)), 0, 1e-15);
  EXPECT_NEAR(glm::dot(n, glm::dvec3(0, -4, 6)), 0, 1e-15);
  EXPECT_GT(n.z, 0);
}

TEST(HeightGrid, TrianglesThatTouchAHoleDoNotExist) {
  const HeightGrid grid({2, 2}, {0, 0}, {1, 1}, {0, 0, 0, hole});
  EXPECT_TRUE(grid.height_m_at({0.2, 0.2}));
  EXPECT_FALSE(grid.height_m_at({0.8, 0.8}));
  EXPECT_EQ(grid.hole_count(), 1u);
}

TEST(HeightGrid, RejectsInvalidGridsAndReportsWhy) {
  EXPECT_THAT(
      [] {
        HeightGrid({1, 1}, {0, 0}, {1, 1}, {0});
      },
      ThrowsMessage<Error>(HasSubstr("1 x 1 samples; a surface needs at least 2 x 2")));
  EXPECT_THAT(
      [] {
        HeightGrid({2, 2}, {0, 0}, {0, 1}, {0, 0, 0});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("step = (0, 1) m"), HasSubstr("3 heights for 2 x 2"))));
  EXPECT_THAT(
      [] {
        HeightGrid({2, 2}, {0, 0}, {1, 1}, {0, 0, 0, std::numeric_limits<float>::infinity()});
      },
      ThrowsMessage<Error>(HasSubstr("a height is infinite")));
}

}  // namespace
}  // namespace groundray::height_grid_test
