#include "core/tracing/closest_point.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "core/error.h"
#include "test/support/scans/solid.h"

namespace groundray::closest_point_test {
namespace {

using ::testing::HasSubstr;

// A point of long doubles, for oracles.
struct Far {
  long double x, y, z;
  explicit Far(const glm::dvec3& p) : x(p.x), y(p.y), z(p.z) {}
  Far(long double px, long double py, long double pz) : x(px), y(py), z(pz) {}
  Far operator-(const Far& o) const { return {x - o.x, y - o.y, z - o.z}; }
  Far operator+(const Far& o) const { return {x + o.x, y + o.y, z + o.z}; }
  Far operator*(long double s) const { return {x * s, y * s, z * s}; }
};
long double dot(const Far& a, const Far& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Far cross(const Far& a, const Far& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// All distances are from the origin: the query point is subtracted first, exactly or nearly so.
long double to_edge(const Far& a, const Far& b) {
  const Far along = b - a;
  const long double square = dot(along, along);
  const long double t = square > 0 ? std::clamp(-dot(a, along) / square, 0.0L, 1.0L) : 0.0L;
  const Far nearest = a + along * t;
  return std::sqrt(dot(nearest, nearest));
}

// Least distance to the segments parallel to an edge. It is convex from the edge to the apex, so a
// ternary search discards the thirds that cannot hold the minimum.
long double to_needle(const Far& a, const Far& b, const Far& c) {
  const auto at = [&](long double t) { return to_edge(a + (c - a) * t, b + (c - b) * t); };
  long double low = 0, high = 1;
  for (int i = 0; i < 110; ++i) {  // (2/3)^110 is below a long double's ulp
    const long double third = (high - low) / 3;
    if (at(low + third) <= at(high - third)) {
      high -= third;
    } else {
      low += third;
    }
  }
  return at(0.5L * (low + high));
}

// Distance to the plane if the point projects inside all three edges, otherwise to the nearest
// edge: by the normal and triple products, in long double. Not precise enough for needles or for
// very distant points.
long double oracle_m(const glm::dvec3& p_m, const TriangleMesh& mesh, std::size_t triangle) {
  const glm::uvec3& t = mesh.triangles[triangle];
  const Far p(p_m), a = Far(mesh.vertices_m[t.x]) - p, b = Far(mesh.vertices_m[t.y]) - p,
                    c = Far(mesh.vertices_m[t.z]) - p;
  const long double edges = std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
  const Far n = cross(b - a, c - a);
  const long double square = dot(n, n);
  const long double far = std::max(dot(c - a, c - a), dot(a, a));
  if (square <= 1e-8L * dot(b - a, b - a) * far) return std::min(edges, to_needle(a, b, c));
  const bool inside =
      dot(cross(a, b), n) >= 0 && dot(cross(b, c), n) >= 0 && dot(cross(c, a), n) >= 0;
  return inside ? std::min(edges, std::abs(dot(a, n)) / std::sqrt(square)) : edges;
}

long double oracle_m(const glm::dvec3& p, const TriangleMesh& mesh) {
  long double least = std::numeric_limits<long double>::infinity();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    least = std::min(least, oracle_m(p, mesh, i));
  return least;
}

using Random = std::mt19937_64;

glm::dvec3 within(double half_m, Random& random) {
  std::uniform_real_distribution<double> place(-half_m, half_m);
  const double x = place(random), y = place(random);
  return {x, y, place(random)};
}

// Triangles of all sizes; one in three is a needle (as thin as 1e-12 of its length), a segment or a
// point.
TriangleMesh soup(int triangles, double half_m, const glm::dvec3& centre_m, Random& random) {
  TriangleMesh mesh;
  std::uniform_real_distribution<double> exponent(-4, 0);
  std::uniform_int_distribution<int> kind(0, 15);
  for (int i = 0; i < triangles; ++i) {
    const glm::dvec3 middle = centre_m + within(half_m, random);
    const double size_m = half_m * std::pow(10, exponent(random));
    const glm::dvec3 a = middle + within(size_m, random), b = middle + within(size_m, random);
    glm::dvec3 c = middle + within(size_m, random);
    const int which = kind(random);
    if (which == 0) c = b;
    if (which == 1) c = 0.5 * (a + b);
    if (which == 2) c = 0.3 * a + 0.7 * b + within(1e-12 * size_m, random);
    if (which == 3) c = a + 1e-6 * (c - a);
    if (which == 5) c = a + 1e-11 * (c - a);
    const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
    mesh.vertices_m.insert(mesh.vertices_m.end(), {a, which == 4 ? a : b, which == 4 ? a : c});
    const auto turn = static_cast<std::uint32_t>(i % 3);  // any corner may be the first
    mesh.triangles.emplace_back(first + turn, first + (turn + 1) % 3, first + (turn + 2) % 3);
  }
  return mesh;
}

// The error bound of vector_to_triangle: 16 ulp of the largest distance.
double tolerance_m(const glm::dvec3& p, const TriangleMesh& mesh) {
  double far_m = 0;
  for (const glm::dvec3& vertex_m : mesh.vertices_m)
    far_m = std::max(far_m, glm::length(vertex_m - p));
  return 16 * std::numeric_limits<double>::epsilon() * far_m;
}

void expect_nearest(const ClosestPoint& target, const glm::dvec3& p) {
  const NearestPoint found = target.nearest(p);
  const double tolerance = tolerance_m(p, target.mesh());
  ASSERT_NEAR(found.distance_m, static_cast<double>(oracle_m(p, target.mesh())), tolerance);
  ASSERT_NEAR(found.distance_m, static_cast<double>(oracle_m(p, target.mesh(), found.triangle)),
              tolerance);
  const double places = tolerance + 2e-16 * glm::length(p);  // rounding of the point's position
  ASSERT_NEAR(glm::length(found.point - p), found.distance_m, places);
  ASSERT_LE(static_cast<double>(oracle_m(found.point, target.mesh(), found.triangle)), places);
}

TEST(ClosestPoint, MatchesASearchOfAllTriangles) {
  Random random(1);
  for (const glm::dvec3& centre_m : {glm::dvec3(0), glm::dvec3(435000, 5150500, 900)}) {
    for (const double half_m : {1e-3, 1.0, 700.0}) {
      const ClosestPoint target(soup(200, half_m, centre_m, random));
      for (int i = 0; i < 150; ++i)
        ASSERT_NO_FATAL_FAILURE(
            expect_nearest(target, centre_m + within(i % 3 == 0 ? 5 * half_m : half_m, random)));
    }
  }
}

TEST(ClosestPoint, IsCorrectOnTheSurfaceAndFromFarAway) {
  Random random(2);
  const TriangleMesh mesh = soup(150, 10, glm::dvec3(0), random);
  const ClosestPoint target(mesh);
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 on =
        0.5 * mesh.vertices_m[t.x] + 0.25 * mesh.vertices_m[t.y] + 0.25 * mesh.vertices_m[t.z];
    ASSERT_LE(target.nearest(on).distance_m, tolerance_m(on, mesh));
    ASSERT_EQ(target.nearest(mesh.vertices_m[t.y]).distance_m, 0);
  }
  for (const double far_m : {1e4, 1e8, 1e15, 1e16, 1e30, 1e100}) {
    for (int i = 0; i < 10; ++i)
      ASSERT_NO_FATAL_FAILURE(expect_nearest(target, far_m * within(1, random)));
  }
}

// Two clusters of triangles 2000 km apart: floats about their common centre are 6 cm apart, more
// than the size of the triangles.
TEST(ClosestPoint, IsCorrectWhereFloatsAreCoarse) {
  Random random(6);
  const glm::dvec3 east(1e6, 1e6, 0);
  TriangleMesh mesh = soup(100, 0.03, east, random);
  const TriangleMesh west = soup(100, 0.03, -east, random);
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.insert(mesh.vertices_m.end(), west.vertices_m.begin(), west.vertices_m.end());
  for (const glm::uvec3& t : west.triangles) mesh.triangles.push_back(t + first);
  const ClosestPoint target(mesh);
  for (int i = 0; i < 100; ++i) {
    const glm::dvec3 p = (i % 2 == 0 ? east : -east) + within(0.05, random);
    const NearestPoint found = target.nearest(p);
    const double tolerance = 1e-13;  // their corners are within 10 cm: see vector_to_triangle
    ASSERT_NEAR(found.distance_m, static_cast<double>(oracle_m(p, mesh)), tolerance);
    ASSERT_NEAR(found.distance_m, static_cast<double>(oracle_m(p, mesh, found.triangle)),
                tolerance);
  }
}

TEST(ClosestPoint, DoesNotDependOnTheStartOfTheSearch) {
  Random random(3);
  const ClosestPoint target(soup(500, 10, glm::dvec3(1e5, 4e6, 0), random));
  std::uniform_int_distribution<std::uint32_t> any(0, 499);
  for (int i = 0; i < 2000; ++i) {
    const glm::dvec3 p = glm::dvec3(1e5, 4e6, 0) + within(12, random);
    const NearestPoint found = target.nearest(p), again = target.nearest(p, any(random));
    ASSERT_EQ(again.triangle, found.triangle);
    ASSERT_EQ(again.point, found.point);
    ASSERT_EQ(again.distance_m, found.distance_m);
  }
}

// Four triangles round a corner, each of them twice: at the corner, above it and beyond an edge all
// are equally distant.
TEST(ClosestPoint, IsOnTheFirstOfEquidistantTriangles) {
  TriangleMesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
  for (int twice = 0; twice < 2; ++twice) {
    for (const glm::uvec3& t : {glm::uvec3(4, 1, 0), {0, 1, 2}, {2, 3, 0}, {3, 4, 0}})
      mesh.triangles.push_back(t);
  }
  const ClosestPoint target(mesh);
  for (std::uint32_t near = 0; near < 8; ++near) {
    EXPECT_EQ(target.nearest({0, 0, 0}, near).triangle, 0u);
    EXPECT_EQ(target.nearest({0, 0, 3}, near).triangle, 0u);
    EXPECT_EQ(target.nearest({-2, 0, 0}, near).triangle, 2u);
    EXPECT_EQ(target.nearest({0.1, 0.3, -1}, near).triangle, 1u);
  }
}

// Two triangles that lean away from their common edge, in either order.
TEST(ClosestPoint, OnASharedEdgeBelongsToItsFirstTriangle) {
  Random random(7);
  const RayDevice device;
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 a = glm::dvec3(-1, 0, 0) + within(0.2, random);
    const glm::dvec3 b = glm::dvec3(1, 0, 0) + within(0.2, random);
    const glm::dvec3 c = glm::dvec3(0, 1, -2) + within(0.3, random);
    const glm::dvec3 d = glm::dvec3(0, -1, -2) + within(0.3, random);
    const glm::dvec3 p = glm::dvec3(0, 0, 1) + within(0.2, random);
    const ClosestPoint target({{a, b, c, d}, {{0, 1, 2}, {1, 0, 3}}, {}}, device);
    const ClosestPoint turned({{a, b, c, d}, {{1, 0, 3}, {0, 1, 2}}, {}}, device);
    ASSERT_EQ(target.nearest(p).triangle, 0u);
    ASSERT_EQ(turned.nearest(p).triangle, 0u);
    ASSERT_EQ(turned.nearest(p).point, target.nearest(p).point);
  }
}

TEST(ClosestPoint, OnABallIsRadiallyBelowThePoint) {
  const ClosestPoint ball(testing::icosphere(1, 4).mesh);
  double depth_m = 0;  // of the facets' centroids below the sphere
  for (const glm::uvec3& t : ball.mesh().triangles) {
    const auto& at = ball.mesh().vertices_m;
    depth_m = std::max(depth_m, 1 - glm::length(at[t.x] + at[t.y] + at[t.z]) / 3);
  }
  // The facets are nearly congruent: the point farthest from the sphere is close to a centroid.
  const double tolerance_m = 1.1 * depth_m;
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 p = within(3, random);
    EXPECT_NEAR(ball.nearest(p).distance_m, std::abs(glm::length(p) - 1), tolerance_m);
  }
}

TEST(ClosestPoint, SupportsConcurrentQueries) {
  Random random(5);
  const ClosestPoint target(soup(500, 10, glm::dvec3(0), random));
  std::vector<glm::dvec3> points(2000);
  for (glm::dvec3& p : points) p = within(12, random);
  std::vector<std::vector<double>> found_m(4, std::vector<double>(points.size()));
  std::vector<std::thread> threads;
  for (auto& mine_m : found_m) {
    threads.emplace_back([&] {
      for (std::size_t i = 0; i < points.size(); ++i)
        mine_m[i] = target.nearest(points[i]).distance_m;
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < points.size(); ++i)
    ASSERT_EQ(found_m[0][i], target.nearest(points[i]).distance_m);
  for (const auto& mine_m : found_m) EXPECT_EQ(mine_m, found_m[0]);
}

std::string message_of(const TriangleMesh& mesh) {
  try {
    const ClosestPoint target(mesh);
  } catch (const Error& error) {
    return error.what();
  }
  return "no Error was thrown";
}

TEST(ClosestPoint, ReportsEveryFaultOfTheMesh) {
  EXPECT_THAT(message_of({}), HasSubstr("mesh: there is no triangle"));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 2e15}) {
    TriangleMesh mesh{{{0, 0, 0}, {1, 0, bad}, {0, 1, 0}}, {{0, 1, 2}, {0, 3, 1}}, {7}};
    EXPECT_THAT(message_of(mesh),
                ::testing::AllOf(HasSubstr("vertex 1 must have a finite position within 1e+15 m"),
                                 HasSubstr("triangle 1 refers to a vertex beyond the last of 3"),
                                 HasSubstr("there are 1 levels for 2 triangles")));
  }
}

}  // namespace
}  // namespace groundray::closest_point_test
