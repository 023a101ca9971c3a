#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "reconstruction/mesh/holes/hole_patch.h"

namespace groundray::triangle_crossing_test {
namespace {

using ::testing::IsEmpty;
using Pair = std::pair<std::uint32_t, std::uint32_t>;
using Whole = glm::vec<3, std::int64_t>;

Whole cross(const Whole& a, const Whole& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

std::int64_t dot(const Whole& a, const Whole& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Returns whether two triangles have a point in common, in integers: convex sets are disjoint if
// and only if they are separated along one of the normals of their Minkowski difference.
bool do_meet(const std::array<Whole, 3>& a, const std::array<Whole, 3>& b) {
  const std::array<Whole, 3> ab{a[1] - a[0], a[2] - a[1], a[0] - a[2]};
  const std::array<Whole, 3> cd{b[1] - b[0], b[2] - b[1], b[0] - b[2]};
  const Whole n = cross(ab[0], ab[1]), m = cross(cd[0], cd[1]);
  std::vector<Whole> axes{n, m};
  for (const Whole& e : ab) {
    axes.push_back(cross(n, e));
    for (const Whole& f : cd) axes.push_back(cross(e, f));
  }
  for (const Whole& f : cd) axes.push_back(cross(m, f));
  return std::ranges::none_of(axes, [&](const Whole& axis) {
    const auto [a_low, a_high] = std::minmax({dot(axis, a[0]), dot(axis, a[1]), dot(axis, a[2])});
    const auto [b_low, b_high] = std::minmax({dot(axis, b[0]), dot(axis, b[1]), dot(axis, b[2])});
    return a_high < b_low || b_high < a_low;
  });
}

TEST(TriangleCrossing, TrianglesWithoutCommonCornersCrossWhereTheyIntersect) {
  std::mt19937_64 random(4);
  int met = 0;
  for (const int range : {2, 3, 6, 40}) {  // few positions: triangles touch, and are coplanar
    for (int trial = 0; trial < 4000; ++trial) {
      TriangleMesh mesh;
      std::vector<Whole> places;
      for (unsigned i = 0; i < 6; ++i) {
        const auto any = [&] { return static_cast<std::int64_t>(random() % unsigned(range)); };
        const auto x = any(), y = any();
        places.emplace_back(x, y, any());
        mesh.vertices_m.emplace_back(places.back());
      }
      const std::array<Whole, 3> a{places[0], places[1], places[2]},
          b{places[3], places[4], places[5]};
      if (std::ranges::find_first_of(a, b) != a.end()) continue;
      const Whole nothing(0);
      if (cross(a[1] - a[0], a[2] - a[0]) == nothing || cross(b[1] - b[0], b[2] - b[0]) == nothing)
        continue;
      mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
      const bool is_found = !crossings(mesh, 1).empty();
      EXPECT_EQ(is_found, do_meet(a, b)) << "range " << range << ", trial " << trial;
      met += is_found;
    }
  }
  EXPECT_GT(met, 1000);
}

TEST(TriangleCrossing, NeighboursCrossWhereTheyOverlap) {
  TriangleMesh mesh{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {4, 4, 0}, {1, 1, 0}, {2, 2, 3}, {1, 1, -3}}};
  const auto of = [&](const glm::uvec3& a, const glm::uvec3& b) {
    mesh.triangles = {a, b};
    return !crossings(mesh, 1).empty();
  };
  EXPECT_FALSE(of({0, 1, 2}, {1, 3, 2})) << "beside each other";
  EXPECT_TRUE(of({0, 1, 2}, {2, 1, 4})) << "folded over";
  EXPECT_FALSE(of({0, 1, 2}, {2, 1, 5})) << "folded, at an angle";
  EXPECT_FALSE(of({0, 1, 4}, {4, 3, 2})) << "a corner in common";
  EXPECT_TRUE(of({0, 1, 2}, {0, 5, 6})) << "a corner in common, and through the middle";
  EXPECT_TRUE(of({0, 1, 2}, {0, 4, 5})) << "a corner in common, and touching";
  EXPECT_TRUE(of({0, 1, 2}, {2, 1, 0})) << "front and back";
  mesh.vertices_m.push_back(mesh.vertices_m[1]);
  EXPECT_FALSE(of({0, 1, 2}, {7, 3, 2})) << "corners at one place count as one";
  EXPECT_FALSE(of({0, 1, 2}, {4, 4, 5})) << "no area";
}

TEST(TriangleCrossing, IsFoundAmongManyTriangles) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> place(0, 1);
  TriangleMesh mesh;
  for (unsigned i = 0; i < 400; ++i) {
    const double x = place(random), y = place(random);
    const glm::dvec3 p(x, y, place(random));
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    for (int k = 0; k < 3; ++k) {
      const double dx = place(random), dy = place(random);
      mesh.vertices_m.push_back(p + 0.2 * glm::dvec3(dx, dy, place(random)));
    }
  }
  std::vector<Pair> each;
  for (std::uint32_t b = 300; b < 400; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) {
      TriangleMesh two{mesh.vertices_m, {mesh.triangles[a], mesh.triangles[b]}};
      if (!crossings(two, 1).empty()) each.emplace_back(a, b);
    }
  }
  std::ranges::sort(each);
  EXPECT_GT(each.size(), 30u);
  EXPECT_EQ(crossings(mesh, 300), each);
  EXPECT_THAT(crossings(mesh, 400), IsEmpty());
  EXPECT_THAT(crossings({}, 0), IsEmpty());
}

}  // namespace
}  // namespace groundray::triangle_crossing_test
