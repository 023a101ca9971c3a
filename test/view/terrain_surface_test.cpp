#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <set>

#include "apps/view/layers/terrain_follower.h"
#include "test/support/terrain/leaf_triangles.h"
#include "test/support/terrain/sample_clipmap.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::terrain_surface_test {
namespace {

using testing::certified_tiles;
using testing::SampleTriangle;

using Corners = std::array<std::array<int, 2>, 3>;

Corners sorted(const SampleTriangle& triangle) {
  Corners corners;
  for (std::size_t k = 0; k < 3; ++k) corners[k] = {triangle[k].x, triangle[k].y};
  std::ranges::sort(corners);
  return corners;
}

std::vector<Level> levels_over(const HeightGrid& grid, double angle_rad) {
  const glm::dvec3 eye(20, -30, grid.max_height_m() + 5);
  return Clipmap(certified_tiles(grid), grid.frame(),
                 {.angle_rad = angle_rad, .memory_bytes = 1'500'000}, {eye, eye})
      .levels();
}

constexpr int last_sample = 512;

glm::ivec2 sample_at(const Layer& layer, int point, const GridFrame& frame) {
  const auto places = coordinates(*layer.data);
  const auto first = std::size_t{3} * static_cast<std::size_t>(point);
  const glm::dvec2 p = glm::dvec2(places[first], places[first + 1]) + glm::dvec2(layer.origin_w_m);
  return {glm::round(frame.to_grid(p))};
}

// Triangles of a layer by the samples at their corners, which are identified by position alone.
std::vector<SampleTriangle> triangles_of(const Layer& layer, const GridFrame& frame) {
  const auto corner = corners(*layer.data);
  std::vector<SampleTriangle> triangles;
  for (std::size_t i = 0; i < corner.size(); i += 3) {
    triangles.push_back({sample_at(layer, corner[i], frame), sample_at(layer, corner[i + 1], frame),
                         sample_at(layer, corner[i + 2], frame)});
  }
  return triangles;
}

class SurfaceOf : public ::testing::TestWithParam<int> {
 protected:
  static HeightGrid grid() {
    const HeightGrid whole =
        testing::fractal(last_sample + 1, 2, 60, Seed{static_cast<std::uint64_t>(GetParam())});
    return GetParam() % 2 == 0 ? whole : testing::with_holes(whole, 12, 6, Seed{5});
  }
};

// The oracle derives the leaves' triangles from docs/theory/terrain.md alone.
TEST_P(SurfaceOf, LeavesMatchTheirDefinition) {
  const HeightGrid grid = this->grid();
  const std::vector<Level> levels = levels_over(grid, 0.01);
  ASSERT_GT(levels.size(), 2u);
  const Layer layer = terrain_layer(levels, glm::dvec3(0), {20, -30, 0});
  std::multiset<Corners> expected, found;
  for (const Level& level : levels) {
    for (const SampleTriangle& triangle :
         testing::leaf_triangles(grid, level.leaves, level.leaf_cells))
      expected.insert(sorted(triangle));
  }
  for (const SampleTriangle& triangle : triangles_of(layer, grid.frame()))
    found.insert(sorted(triangle));
  EXPECT_EQ(found.size(), expected.size());
  EXPECT_TRUE(found == expected);
  EXPECT_LE(layer.triangles(), count_triangles(levels));
}

TEST_P(SurfaceOf, PointsLieOnTheDem) {
  const HeightGrid grid = this->grid();
  const Layer layer = terrain_layer(levels_over(grid, 0.01), glm::dvec3(0), {20, -30, 0});
  const auto places = coordinates(*layer.data);
  for (std::size_t i = 0; i < layer.points(); ++i) {
    const glm::dvec2 p =
        glm::dvec2(places[3 * i], places[3 * i + 1]) + glm::dvec2(layer.origin_w_m);
    const glm::ivec2 sample(glm::round(grid.frame().to_grid(p)));
    ASSERT_EQ(places[3 * i + 2], grid.height_m(sample.x, sample.y));
  }
}

// No edge has two triangles on the same side, so the surface is counter-clockwise from above
// everywhere. Without T-junctions, each edge has two triangles, except at the boundary and round
// holes.
TEST_P(SurfaceOf, TrianglesFaceUpAndShareEdges) {
  const HeightGrid grid = this->grid();
  const Layer layer = terrain_layer(levels_over(grid, 0.01), glm::dvec3(0), {20, -30, 0});
  const auto places = coordinates(*layer.data);
  const auto corner = corners(*layer.data);
  std::set<std::pair<int, int>> edges;
  for (std::size_t i = 0; i < corner.size(); i += 3) {
    const auto at = [&](std::size_t k) {
      const auto first = std::size_t{3} * static_cast<std::size_t>(corner[i + k]);
      return glm::dvec2(places[first], places[first + 1]);
    };
    const glm::dvec2 u = at(1) - at(0), v = at(2) - at(0);
    ASSERT_GT(u.x * v.y - u.y * v.x, 0);
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_TRUE(edges.emplace(corner[i + k], corner[i + (k + 1) % 3]).second);
  }
  if (GetParam() % 2 != 0) return;
  for (const auto& [a, b] : edges) {
    if (edges.contains({b, a})) continue;
    const glm::ivec2 from = sample_at(layer, a, grid.frame()),
                     to = sample_at(layer, b, grid.frame());
    const auto is_rim = [](int i, int j) { return i == j && (i == 0 || i == last_sample); };
    ASSERT_TRUE(is_rim(from.x, to.x) || is_rim(from.y, to.y));
  }
}

INSTANTIATE_TEST_SUITE_P(Terrains, SurfaceOf, ::testing::Values(2, 3, 4, 5));

// A triangle deviates by no more than its leaf's certified deviation, checked at all samples below
// it.
TEST(TerrainSurface, HasTheCertifiedDeviationOfEachTriangle) {
  const HeightGrid grid = testing::fractal(129, 2, 60, Seed{9});
  const Layer layer = terrain_layer(levels_over(grid, 0.02), glm::dvec3(0), {20, -30, 0});
  const LayerColumn* const deviation = layer.find("certified deviation");
  ASSERT_NE(deviation, nullptr);
  const auto triangles = triangles_of(layer, grid.frame());
  double worst_m = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& [a, b, c] = triangles[i];
    const glm::ivec2 low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
    const glm::dvec2 u(b - a), v(c - a);
    const double area = u.x * v.y - u.y * v.x;
    for (int row = low.y; row <= high.y; ++row) {
      for (int column = low.x; column <= high.x; ++column) {
        const glm::dvec2 w(column - a.x, row - a.y);
        const double p = (w.x * v.y - w.y * v.x) / area, q = (u.x * w.y - u.y * w.x) / area;
        if (p < 0 || q < 0 || p + q > 1) continue;
        const double height = (1 - p - q) * grid.height_m(a.x, a.y) + p * grid.height_m(b.x, b.y) +
                              q * grid.height_m(c.x, c.y);
        const double off_m = std::abs(height - grid.height_m(column, row));
        worst_m = std::max(worst_m, off_m);
        ASSERT_LE(off_m, layer.value(*deviation, static_cast<vtkIdType>(i)) + 1e-9);
      }
    }
  }
  EXPECT_GT(worst_m, 0.1);
}

TEST(TerrainSurface, SlopeOfAPlaneIsExact) {
  std::vector<float> heights;
  for (int row = 0; row < 17; ++row) {
    for (int column = 0; column < 17; ++column)
      heights.push_back(static_cast<float>(column * 2 * std::tan(glm::radians(30.0))));
  }
  const HeightGrid grid({17, 17}, {0, 0}, {2, -2}, std::move(heights));
  const Layer layer = terrain_layer(levels_over(grid, 0), glm::dvec3(0), glm::dvec3(0));
  const LayerColumn* const slope = layer.find("slope");
  ASSERT_NE(slope, nullptr);
  for (std::size_t i = 0; i < layer.triangles(); ++i)
    EXPECT_NEAR(layer.value(*slope, static_cast<vtkIdType>(i)), 30, 1e-3);
}

}  // namespace
}  // namespace groundray::terrain_surface_test
