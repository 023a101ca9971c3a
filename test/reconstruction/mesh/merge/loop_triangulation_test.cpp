#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <vector>

#include "reconstruction/mesh/merge/stitched_mesh.h"

namespace groundray::loop_triangulation_test {
namespace {

using ::testing::UnorderedElementsAre;

double area_up_m2(std::span<const glm::dvec3> loop, const LoopTriangles& cut) {
  double sum = 0;
  for (const glm::uvec3& t : cut.triangles)
    sum += glm::cross(loop[t.y] - loop[t.x], loop[t.z] - loop[t.x]).z / 2;
  return sum;
}

// Area by the shoelace formula.
double area_m2(std::span<const glm::dvec3> loop) {
  double sum = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const glm::dvec3 &a = loop[i], &b = loop[(i + 1) % loop.size()];
    sum += (a.x * b.y - a.y * b.x) / 2;
  }
  return sum;
}

// Distances from the centre are random, so that corners may be concave; every edge turns the same
// way about the centre, so that the loop does not cross itself.
TEST(LoopTriangulation, CoversStarsOnceByUprightTriangles) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> reach(0.3, 1);
  for (int corners = 3; corners < 60; ++corners) {
    std::vector<glm::dvec3> loop;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * i / corners, r = reach(random);
      loop.emplace_back(r * std::cos(angle), r * std::sin(angle), 0);
    }
    const LoopTriangles cut = triangulate_loop(loop, {0, 0, 1});
    EXPECT_EQ(cut.triangles.size(), loop.size() - 2);
    EXPECT_NEAR(area_up_m2(loop, cut), area_m2(loop), 1e-12);
    if (corners <= 40) {
      EXPECT_TRUE(cut.is_upright) << corners;
    }
  }
}

TEST(LoopTriangulation, UsesTheShorterDiagonal) {
  const std::vector<glm::dvec3> kite{{0, 0, 0}, {2, -0.5, 0}, {4, 0, 0}, {2, 0.5, 0}};
  EXPECT_THAT(triangulate_loop(kite, {0, 0, 1}).triangles,
              UnorderedElementsAre(glm::uvec3(0, 1, 3), glm::uvec3(1, 2, 3)));
}

// Vertices on the edges of a triangle: no triangle may be degenerate.
TEST(LoopTriangulation, CollinearCornersMakeNoDegenerateTriangle) {
  const std::vector<glm::dvec3> loop{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0},
                                     {0, 3, 0}, {0, 2, 0}, {0, 1, 0}};
  const LoopTriangles cut = triangulate_loop(loop, {0, 0, 1});
  EXPECT_TRUE(cut.is_upright);
  for (const glm::uvec3& t : cut.triangles)
    EXPECT_GT(glm::cross(loop[t.y] - loop[t.x], loop[t.z] - loop[t.x]).z, 0.1);
}

TEST(LoopTriangulation, AReversedLoopIsNotUpright) {
  const std::vector<glm::dvec3> loop{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  EXPECT_FALSE(triangulate_loop(loop, {0, 0, -1}).is_upright);
  EXPECT_EQ(triangulate_loop(std::vector(5, glm::dvec3(1)), {0, 0, 1}).triangles.size(), 3u);
}

}  // namespace
}  // namespace groundray::loop_triangulation_test
