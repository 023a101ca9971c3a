#include "reconstruction/mesh/accuracy/cover_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "core/tracing/closest_point.h"
#include "test/support/scans/solid.h"

namespace groundray::cover_bound_test {
namespace {

using Corners = std::array<glm::dvec3, 3>;
using Random = std::mt19937_64;

constexpr double infinity = std::numeric_limits<double>::infinity();
const glm::dvec3 up(0, 0, 1);

// Square grid from (0, 0) to (10, 10).
TriangleMesh grid(unsigned cells, const std::function<double(double, double)>& height_m) {
  TriangleMesh mesh;
  for (unsigned row = 0; row <= cells; ++row) {
    for (unsigned column = 0; column <= cells; ++column) {
      const double x = 10.0 * column / cells, y = 10.0 * row / cells;
      mesh.vertices_m.emplace_back(x, y, height_m(x, y));
      if (row == cells || column == cells) continue;
      const unsigned a = row * (cells + 1) + column, c = a + cells + 1;
      mesh.triangles.insert(mesh.triangles.end(), {{a, a + 1, c}, {a + 1, c + 1, c}});
    }
  }
  return mesh;
}

std::uint32_t nearest(const ClosestPoint& mesh, const Corners& corners) {
  return mesh.nearest((corners[0] + corners[1] + corners[2]) / 3.0).triangle;
}

TEST(CoverBound, BoundOfATiltedTriangleIsItsHighestCorner) {
  const TriangleMesh plane = grid(7, [](double, double) { return 2.0; });
  const CoverBound cover(plane);
  const Corners corners{{{1, 1, 2.5}, {8, 1.3, 3}, {4, 9, 1.7}}};
  const std::uint32_t start = nearest(ClosestPoint(plane), corners);
  EXPECT_NEAR(cover.bound_m(corners, up, start), 1, 1e-4);
  EXPECT_GE(cover.bound_m(corners, up, start), 1);
  // Independent of the orientation of the triangle and of the direction.
  const Corners turned{{corners[0], corners[2], corners[1]}};
  EXPECT_NEAR(cover.bound_m(turned, {0, 0, -5}, start), 1, 1e-4);
  // Along the triangle's own normal the plane is farther by the cosine.
  const glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
  EXPECT_NEAR(cover.bound_m(corners, normal, start), glm::length(normal) / normal.z, 1e-4);
}

// Triangles permit exactly their distance and no more; each that covers a part of the triangle is
// queried.
TEST(CoverBound, ComparesWithTheDistancePermittedByEachTriangle) {
  const TriangleMesh plane = grid(50, [](double, double) { return 2.0; });
  const CoverBound cover(plane);
  const Corners corners{{{1, 1, 2.5}, {8, 1.3, 3}, {4, 9, 1.7}}};  // over 1400 triangles
  const std::uint32_t start = nearest(ClosestPoint(plane), corners);
  EXPECT_EQ(cover.bound_m(corners, up, start), infinity);
  EXPECT_TRUE(cover.is_within(corners, up, start, [](std::uint32_t) { return 1.0001; }));
  EXPECT_FALSE(cover.is_within(corners, up, start, [](std::uint32_t) { return 0.9999; }));
  std::size_t asked = 0;
  const auto allow = [&](std::uint32_t triangle) {
    ++asked;
    return plane.vertices_m[plane.triangles[triangle].x].y < 4.9 ? 1.001 : 0.51;
  };
  EXPECT_FALSE(
      cover.is_within(corners, up, start, [&](std::uint32_t t) { return allow(t) - 0.1; }));
  asked = 0;
  EXPECT_TRUE(cover.is_within(corners, up, start, allow));
  EXPECT_GT(asked, 1300u);
}

// Nothing is shrunk by more than the permitted distance requires.
TEST(CoverBound, ProvesSmallDistances) {
  const TriangleMesh plane = grid(7, [](double, double) { return 2.0; });
  const CoverBound cover(plane);
  const Corners corners{{{0, 0, 2}, {10, 0, 2}, {0, 10, 2}}};
  const std::uint32_t start = nearest(ClosestPoint(plane), corners);
  EXPECT_TRUE(cover.is_within(corners, up, start, [](std::uint32_t) { return 1e-7; }));
}

TEST(CoverBound, HandlesCoincidentBorders) {
  const TriangleMesh fine = grid(16, [](double x, double) { return 0.01 * x * (10 - x); });
  const CoverBound cover(fine);
  const Corners half{{{0, 0, 0}, {10, 0, 0}, {0, 10, 0}}};
  EXPECT_EQ(cover.bound_m(half, up, nearest(ClosestPoint(fine), half)), infinity);  // 256 below
  const TriangleMesh coarse = grid(6, [](double x, double) { return 0.01 * x * (10 - x); });
  const double crest_m = 0.25;  // of a grid with vertices at x = 5
  EXPECT_NEAR(CoverBound(coarse).bound_m(half, up, nearest(ClosestPoint(coarse), half)), crest_m,
              1e-4);
}

TEST(CoverBound, IsInfiniteOverBordersHolesAndFolds) {
  TriangleMesh plane = grid(8, [](double, double) { return 0.0; });
  const Corners inner{{{3, 3, 1}, {7, 3, 1}, {5, 7, 1}}}, over{{{3, 3, 1}, {7, 3, 1}, {5, 11, 1}}};
  const std::uint32_t start = nearest(ClosestPoint(plane), inner);
  EXPECT_NEAR(CoverBound(plane).bound_m(inner, up, start), 1, 1e-4);
  EXPECT_EQ(CoverBound(plane).bound_m(over, up, start), infinity);
  EXPECT_EQ(CoverBound(plane).bound_m(inner, {0, 0, 0}, start), infinity);
  EXPECT_EQ(CoverBound(plane).bound_m(inner, {1, 0, 0}, start), infinity);  // seen edge on
  const Corners away{{{13, 3, 1}, {17, 3, 1}, {15, 7, 1}}};
  EXPECT_EQ(CoverBound(plane).bound_m(away, up, start), infinity);
  TriangleMesh torn = plane;
  torn.triangles.erase(torn.triangles.begin() + 54);  // below its middle
  EXPECT_EQ(CoverBound(torn).bound_m(inner, up, 50), infinity);
  TriangleMesh folded = plane;
  folded.vertices_m[40].x += 3;  // beyond its neighbour
  EXPECT_EQ(CoverBound(folded).bound_m(inner, up, start), infinity);
}

// Oracle: dense points of the triangle. None is farther from the mesh than the bound, and the
// height of one over the mesh along the direction equals the bound.
TEST(CoverBound, BoundsTheDistanceByTheLargestHeight) {
  Random random(6);
  std::uniform_real_distribution<double> place(1, 9), share(0, 1), small(-1, 1);
  int found = 0;
  for (int round = 0; round < 60; ++round) {
    const double steep = 0.2 * share(random);
    const TriangleMesh mesh = grid(
        12, [&](double x, double y) { return steep * (std::sin(x) + small(random)) + 0.3 * y; });
    const ClosestPoint to(mesh);
    Corners corners;
    for (glm::dvec3& p : corners) {
      const double x = place(random), y = place(random);
      p = {x, y, 0.3 * y + 0.4 * small(random)};
    }
    const bool is_upright = round % 2 == 0;
    const glm::dvec3 direction = is_upright ? up : glm::dvec3(0, -0.3, 1);
    const double bound_m = CoverBound(mesh).bound_m(corners, direction, nearest(to, corners));
    if (bound_m == infinity) continue;
    ++found;
    double farthest_m = 0, highest_m = 0;
    constexpr int steps = 60;
    for (int i = 0; i <= steps; ++i) {
      for (int k = 0; k + i <= steps; ++k) {
        const double u = static_cast<double>(i) / steps, v = static_cast<double>(k) / steps;
        const glm::dvec3 p = u * corners[0] + v * corners[1] + (1 - u - v) * corners[2];
        farthest_m = std::max(farthest_m, to.nearest(p).distance_m);
        if (!is_upright) continue;
        // Height over the grid's triangle below, in that triangle's plane.
        for (const glm::uvec3& t : mesh.triangles) {
          const glm::dvec3 a = mesh.vertices_m[t.x], ab = mesh.vertices_m[t.y] - a,
                           ac = mesh.vertices_m[t.z] - a, ap = p - a;
          const double area = ab.x * ac.y - ab.y * ac.x;
          const double to_b = (ap.x * ac.y - ap.y * ac.x) / area;
          const double to_c = (ab.x * ap.y - ab.y * ap.x) / area;
          if (to_b < 0 || to_c < 0 || to_b + to_c > 1) continue;
          highest_m = std::max(highest_m, std::abs(ap.z - to_b * ab.z - to_c * ac.z));
        }
      }
    }
    EXPECT_LE(farthest_m, bound_m);
    if (is_upright) {
      EXPECT_LE(highest_m, bound_m);
      EXPECT_NEAR(highest_m, bound_m, 0.1);  // a step of a sixtieth over slopes of 0.5
    }
  }
  EXPECT_GT(found, 40);
}

// Facets of a coarse ball against a finer one: normals differ, and the ball curves away behind.
TEST(CoverBound, IsTightOverABall) {
  const TriangleMesh coarse = testing::icosphere(1, 1).mesh, fine = testing::icosphere(1, 2).mesh;
  const ClosestPoint to(fine);
  const CoverBound cover(fine);
  for (const glm::uvec3& t : coarse.triangles) {
    const Corners corners{{coarse.vertices_m[t.x], coarse.vertices_m[t.y], coarse.vertices_m[t.z]}};
    const glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
    const double bound_m = cover.bound_m(corners, normal, nearest(to, corners));
    // The fine ball's vertices lie on the sphere, above the midpoints of the coarse ball's edges.
    double sagitta_m = 0;
    for (std::size_t k = 0; k < 3; ++k)
      sagitta_m = std::max(sagitta_m, 1 - glm::length(corners[k] + corners[(k + 1) % 3]) / 2);
    EXPECT_GE(bound_m, sagitta_m * 0.9);
    EXPECT_LE(bound_m, 2 * sagitta_m);
  }
}

}  // namespace
}  // namespace groundray::cover_bound_test
