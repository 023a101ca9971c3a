#include "core/geometry/triangle_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "core/geometry/voxel_grid.h"
#include "core/random.h"

namespace groundray::triangle_box_test {
namespace {

// Random point in [-reach, reach]^3 about a centre.
glm::dvec3 random_point(std::uint32_t number, std::uint32_t draw, double reach) {
  const glm::dvec2 a = random_uniform({Seed{number}, draw, 0, 0}),
                   b = random_uniform({Seed{number}, draw, 1, 0});
  return reach * (2.0 * glm::dvec3(a, b.x) - 1.0);
}

// Triangles of all proportions and sizes about the unit box, which they overlap in a sixth of
// cases.
Corners random_triangle(std::uint32_t number) {
  const double size = std::exp2(-static_cast<double>(number % 8) + 2);
  const double thin = number % 3 == 0 ? 1e-3 : 1;
  const glm::dvec3 at = random_point(number, 0, 1.2) + 0.5;
  const glm::dvec3 edge = random_point(number, 1, size);
  return {at, at + edge, at + edge / 2.0 + thin * random_point(number, 2, size)};
}

// Polygon of a triangle in a box, by clipping with one half-space after the other, in long double.
using Point = std::array<long double, 3>;
std::vector<Point> clipped(const Corners& triangle, const glm::dvec3& low, const glm::dvec3& high) {
  std::vector<Point> polygon;
  for (const glm::dvec3& p : triangle) polygon.push_back({p.x, p.y, p.z});
  for (std::size_t side = 0; side < 6; ++side) {
    const std::size_t axis = side / 2;
    const auto at = static_cast<glm::length_t>(axis);
    const auto depth = [&](const Point& p) {
      return side % 2 == 0 ? p[axis] - static_cast<long double>(low[at])
                           : static_cast<long double>(high[at]) - p[axis];
    };
    std::vector<Point> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const long double from = depth(a), to = depth(b);
      if (from >= 0) kept.push_back(a);
      if ((from > 0 && to < 0) || (from < 0 && to > 0)) {
        Point p{};
        for (std::size_t k = 0; k < 3; ++k) p[k] = a[k] + (b[k] - a[k]) * (from / (from - to));
        kept.push_back(p);
      }
    }
    polygon = kept;
  }
  return polygon;
}

double area_of(const Corners& t) { return glm::length(glm::cross(t[1] - t[0], t[2] - t[0])) / 2; }

TEST(TriangleBox, TrianglesOverlapBoxesInWhichClippingLeavesAPolygon) {
  int overlaps = 0;
  constexpr std::uint32_t count = 200'000;
  for (std::uint32_t number = 0; number < count; ++number) {
    const Corners triangle = random_triangle(number);
    const bool expected = !clipped(triangle, glm::dvec3(0), glm::dvec3(1)).empty();
    ASSERT_EQ(overlaps_box(triangle, glm::dvec3(0), glm::dvec3(1)), expected) << number;
    overlaps += expected ? 1 : 0;
  }
  EXPECT_GT(overlaps, count / 10);
  EXPECT_LT(overlaps, count / 2);
}

// All numbers are exact in binary.
TEST(TriangleBox, BoundariesBelongToBoth) {
  const glm::dvec3 low(0), high(1);
  constexpr double off = 0x1p-40;
  const Corners on_face{glm::dvec3(0.25, 0.25, 1), {0.75, 0.25, 1}, {0.25, 0.75, 1}};
  const Corners at_edge{glm::dvec3(1, 0.25, 1), {1, 0.75, 1}, {2, 0.5, 2}};
  const Corners at_corner{glm::dvec3(1, 1, 1), {2, 1, 1}, {1, 2, 2}};
  // Its plane x + y + z = 3 touches a corner of the box, but the triangle only with its inside.
  const Corners around_corner{glm::dvec3(2, 1, 0), {0, 2, 1}, {1, 0, 2}};
  for (Corners triangle : {on_face, at_edge, at_corner, around_corner}) {
    EXPECT_TRUE(overlaps_box(triangle, low, high));
    for (glm::dvec3& corner : triangle) corner += off;
    EXPECT_FALSE(overlaps_box(triangle, low, high));
  }
  EXPECT_TRUE(overlaps_box(on_face, {0, 0, 1}, {1, 1, 2}));
  EXPECT_EQ(part_in_box(on_face, low, high).area, 0.125);
  EXPECT_EQ(part_in_box(at_corner, low, high).area, 0);
  EXPECT_EQ(part_in_box(at_corner, low, high).centroid, glm::dvec3(1));
}

TEST(TriangleBox, PartsInAllVoxelsMakeUpTheTriangle) {
  const VoxelGrid grid{.size = {17, 18, 16}, .low_m = {-8.5, -8.75, -8}, .side_m = 1};
  for (std::uint32_t number = 0; number < 300; ++number) {
    const Corners triangle = random_triangle(8 * number + number % 4);
    double area = 0;
    glm::dvec3 moment(0);
    for (std::size_t i = 0; i < grid.count(); ++i) {
      const glm::ivec3 voxel = grid.voxel(i);
      ASSERT_EQ(grid.index(voxel), i);
      const glm::dvec3 low = grid.corner_m(voxel), high = grid.corner_m(voxel + 1);
      if (!overlaps_box(triangle, low, high)) continue;
      const TrianglePart part = part_in_box(triangle, low, high);
      area += part.area;
      moment += part.area * part.centroid;
      for (glm::length_t axis = 0; axis < 3; ++axis) {
        EXPECT_GE(part.centroid[axis], low[axis] - 1e-12);
        EXPECT_LE(part.centroid[axis], high[axis] + 1e-12);
      }
    }
    // Sums of some hundred products of numbers below 10.
    const double whole = area_of(triangle);
    EXPECT_NEAR(whole_part(triangle).area, whole, 1e-15 * whole);
    EXPECT_NEAR(glm::distance(whole_part(triangle).centroid,
                              (triangle[0] + triangle[1] + triangle[2]) / 3.0),
                0, 1e-14);
    EXPECT_NEAR(area, whole, 1e-12) << number;
    const glm::dvec3 expected = whole * (triangle[0] + triangle[1] + triangle[2]) / 3.0;
    for (glm::length_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(moment[axis], expected[axis], 1e-11) << number;
  }
}

// Length of a segment in a box, by the parameters of its planes.
double length_in(const glm::dvec3& from, const glm::dvec3& to, const glm::dvec3& low,
                 const glm::dvec3& high) {
  double begin = 0, end = 1;
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    const double a = (low[axis] - from[axis]) / (to[axis] - from[axis]);
    const double b = (high[axis] - from[axis]) / (to[axis] - from[axis]);
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return std::max(0.0, end - begin) * glm::length(to - from);
}

TEST(VoxelGrid, WalksVisitTheVoxelsThatASegmentCrossesInOrder) {
  const VoxelGrid grid{.size = {7, 5, 6}, .low_m = {-1, 0.5, -3}, .side_m = 0.4};
  std::size_t visits = 0;
  for (std::uint32_t number = 0; number < 3000; ++number) {
    const glm::dvec3 from = random_point(number, 3, 4), to = random_point(number, 4, 4);
    std::vector<glm::ivec3> visited;
    walk_voxels(grid, from, to, [&](const glm::ivec3& voxel) {
      visited.push_back(voxel);
      return true;
    });
    visits += visited.size();
    for (std::size_t i = 0; i < visited.size(); ++i) {
      ASSERT_TRUE(grid.contains(visited[i]));
      if (i == 0) continue;
      const glm::ivec3 step = glm::abs(visited[i] - visited[i - 1]);
      EXPECT_EQ(step.x + step.y + step.z, 1);
    }
    for (std::size_t i = 0; i < grid.count(); ++i) {
      const glm::ivec3 voxel = grid.voxel(i);
      const double length = length_in(from, to, grid.corner_m(voxel), grid.corner_m(voxel + 1));
      const bool is_visited = std::ranges::find(visited, voxel) != visited.end();
      if (length > 1e-12) {
        EXPECT_TRUE(is_visited) << number;
      } else if (is_visited) {
        EXPECT_GE(length_in(from, to, grid.corner_m(voxel) - 1e-9, grid.corner_m(voxel + 1) + 1e-9),
                  1e-12);
      }
    }
  }
  EXPECT_GT(visits, 3000);
}

TEST(VoxelGrid, WalksStopWhereTheyAreTold) {
  const VoxelGrid grid{.size = {4, 1, 1}};
  std::vector<int> visited;
  walk_voxels(grid, {0.5, 0.5, 0.5}, {9, 0.5, 0.5}, [&](const glm::ivec3& voxel) {
    visited.push_back(voxel.x);
    return voxel.x < 2;
  });
  EXPECT_EQ(visited, (std::vector{0, 1, 2}));
}

TEST(VoxelGrid, PointsOnABoundaryBelongToTheUpperVoxel) {
  const VoxelGrid grid{.size = {2, 2, 2}, .low_m = {-1, -1, -1}};
  EXPECT_EQ(grid.voxel_at({-1, 0, -0.5}), glm::ivec3(0, 1, 0));
  EXPECT_FALSE(grid.voxel_at({1, 0, 0}));
  EXPECT_FALSE(grid.voxel_at({0, 0, std::nan("")}));
  EXPECT_EQ(grid.index({1, 0, 1}), 5);
}

}  // namespace
}  // namespace groundray::triangle_box_test
