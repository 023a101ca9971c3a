#include "reconstruction/mesh/scan/advancing_front.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/error.h"
#include "test/support/terrain/surface_check.h"

namespace groundray::advancing_front_test {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Points = std::vector<glm::dvec3>;

// Points spread evenly over the unit ball: a golden-angle spiral.
Points ball_points(int count) {
  Points points_m;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, angle = i * pi * (3 - std::sqrt(5.0));
    const double radius = std::sqrt(1 - z * z);
    points_m.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  return points_m;
}

Points grid_points(int side, double z_m, double step_m = 1) {
  Points points_m;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column)
      points_m.emplace_back(column * step_m, row * step_m, z_m);
  }
  return points_m;
}

double longest_perimeter_m(const TriangleMesh& mesh) {
  double longest_m = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 &a = mesh.vertices_m[t.x], &b = mesh.vertices_m[t.y],
                     &c = mesh.vertices_m[t.z];
    longest_m =
        std::max(longest_m, glm::distance(a, b) + glm::distance(b, c) + glm::distance(c, a));
  }
  return longest_m;
}

void expect_sound(const FrontMesh& front, const Points& points_m) {
  ASSERT_EQ(front.sources.size(), front.mesh.vertices_m.size());
  EXPECT_TRUE(std::ranges::is_sorted(front.sources));
  for (std::size_t i = 0; i < front.sources.size(); ++i)
    EXPECT_EQ(front.mesh.vertices_m[i], points_m[front.sources[i]]);
  for (const std::string& fault : testing::surface_faults(front.mesh))
    EXPECT_THAT(fault, HasSubstr("joins"));  // surfaces may touch at a point
}

TEST(AdvancingFront, ClosesABallFacingTheSensor) {
  const Points points_m = ball_points(3000);
  for (const double side : {3.0, 0.0}) {  // from outside, and from the centre
    Points origins_m;
    for (const glm::dvec3& p : points_m) origins_m.push_back(side * p);
    const FrontMesh front = advance_front(points_m, 3, origins_m);
    expect_sound(front, points_m);
    EXPECT_THAT(testing::surface_faults(front.mesh), IsEmpty());
    EXPECT_EQ(front.mesh.vertices_m.size(), points_m.size());
    EXPECT_EQ(testing::border_edges(front.mesh), 0u);
    EXPECT_EQ(testing::euler_number(front.mesh), 2);
    // A facet with edge e lies e^2 / 6 below the ball in the mean; e is about 0.07.
    EXPECT_NEAR(testing::area_m2(front.mesh), 4 * pi, 0.02);
    EXPECT_NEAR(testing::volume_m3(front.mesh), (side > 1 ? 4 : -4) * pi / 3, 0.02);
  }
}

TEST(AdvancingFront, CoversAPlaneOfPointsInRowsAtAnyPosition) {
  for (const double north_m : {0.0, 5312345.0}) {
    Points points_m = grid_points(30, 0), origins_m;
    for (glm::dvec3& p : points_m) {
      p.y += north_m;
      origins_m.push_back(p + glm::dvec3(0, 0, 5));
    }
    const FrontMesh front = advance_front(points_m, 3.5, origins_m);
    expect_sound(front, points_m);
    EXPECT_EQ(front.mesh.triangles.size(), 2u * 29 * 29);
    EXPECT_NEAR(testing::area_m2(front.mesh), 29 * 29, 1e-9);
    EXPECT_EQ(testing::euler_number(front.mesh), 1);
    for (const glm::uvec3& t : front.mesh.triangles) {
      const glm::dvec3& a = front.mesh.vertices_m[t.x];
      EXPECT_GT(glm::cross(front.mesh.vertices_m[t.y] - a, front.mesh.vertices_m[t.z] - a).z, 0);
    }
  }
}

TEST(AdvancingFront, CoversRoughGround) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> place(0, 20);
  Points points_m;
  for (int i = 0; i < 4000; ++i) {
    const double x = place(random), y = place(random);
    points_m.emplace_back(x, y, 0.3 * std::sin(x) + 0.2 * std::cos(1.3 * y));
  }
  const FrontMesh front = advance_front(points_m, 3);
  expect_sound(front, points_m);
  double plan_m2 = 0;
  for (const glm::uvec3& t : front.mesh.triangles) {
    const glm::dvec3& a = front.mesh.vertices_m[t.x];
    plan_m2 +=
        0.5 *
        std::abs(glm::cross(front.mesh.vertices_m[t.y] - a, front.mesh.vertices_m[t.z] - a).z);
  }
  EXPECT_NEAR(plan_m2, 400, 12);  // minus a border about half as wide as the point spacing, 0.3 m
}

TEST(AdvancingFront, SeparatesSheetsFartherApartThanTheLimit) {
  Points points_m = grid_points(15, 0, 0.5), origins_m;
  for (const glm::dvec3& p : grid_points(15, 4, 0.5)) points_m.push_back(p);
  for (const glm::dvec3& p : points_m) origins_m.emplace_back(p.x, p.y, 2);  // between them
  const FrontMesh front = advance_front(points_m, 3, origins_m);
  expect_sound(front, points_m);
  EXPECT_EQ(testing::euler_number(front.mesh), 2) << "two sheets";
  EXPECT_NEAR(testing::area_m2(front.mesh), 2 * 49, 1e-9);
  for (const glm::uvec3& t : front.mesh.triangles) {
    const glm::dvec3& a = front.mesh.vertices_m[t.x];
    const double up = glm::cross(front.mesh.vertices_m[t.y] - a, front.mesh.vertices_m[t.z] - a).z;
    EXPECT_GT(a.z < 2 ? up : -up, 0);
  }
}

TEST(AdvancingFront, BridgesNoGapBeyondTheLimit) {
  Points points_m;
  for (const glm::dvec3& p : grid_points(40, 0, 0.25)) {
    if (std::abs(p.x - 5) > 1.1) points_m.push_back(p);
  }
  for (const double limit_m : {0.9, 2.0, 4.0, 6.0}) {
    const FrontMesh front = advance_front(points_m, limit_m);
    EXPECT_LE(longest_perimeter_m(front.mesh), limit_m);
    EXPECT_EQ(testing::euler_number(front.mesh), limit_m < 5 ? 2 : 1);
  }
}

TEST(AdvancingFront, WorksWithoutALimit) {
  const Points points_m = ball_points(300);
  const FrontMesh front = advance_front(points_m, 3);
  EXPECT_EQ(testing::euler_number(front.mesh), 2);
  for (const double limit_m : {1e9, std::numeric_limits<double>::infinity()})
    EXPECT_EQ(advance_front(points_m, limit_m).mesh.triangles, front.mesh.triangles);
}

TEST(AdvancingFront, IgnoresRepeatedAndNonFinitePoints) {
  Points points_m = ball_points(500);
  const std::size_t all = points_m.size();
  for (std::size_t i = 0; i < all; i += 3) points_m.push_back(points_m[i]);
  points_m.insert(points_m.begin() + 7, {std::nan(""), 0, 0});
  points_m.emplace_back(0, INFINITY, 0);
  const FrontMesh front = advance_front(points_m, 3);
  expect_sound(front, points_m);
  EXPECT_EQ(front.not_finite, 2u);
  EXPECT_EQ(front.repeated, (all + 2) / 3);
  EXPECT_EQ(front.mesh.vertices_m.size(), all);
}

TEST(AdvancingFront, TooFewPointsMakeNoSurface) {
  const glm::dvec3 p(1, 2, 3), step(0.1, 0.2, 0.3), nan(std::nan(""));
  for (const Points& points_m :
       {Points{}, Points{p}, Points{p, p + step}, Points{p, p, p, p + step}, Points{nan, nan, p},
        Points{p, p + step, p + 2.0 * step, p + 4.0 * step}, Points(50, p)}) {
    const FrontMesh front = advance_front(points_m, 3);
    EXPECT_TRUE(front.mesh.triangles.empty());
    EXPECT_TRUE(front.mesh.vertices_m.empty());
  }
  Points line_m;  // on which coordinates are round to a nanometre
  for (int i = 0; i < 50; ++i)
    line_m.push_back(glm::dvec3(5e5, 5312345, 2e2) + (0.1 * i) * glm::dvec3(0.36, 0.48, 0.8));
  EXPECT_TRUE(advance_front(line_m, 3).mesh.triangles.empty());
  EXPECT_EQ(advance_front(Points{p, p + step, p + glm::dvec3(1, 0, 0)}, 3).mesh.triangles.size(),
            1u);
}

TEST(AdvancingFront, SameResultForAnyStateOfTheHeap) {
  Points points_m = grid_points(20, 0);  // any two triangles are equally good
  for (const glm::dvec3& p : grid_points(20, 0.7)) points_m.push_back(p);
  const FrontMesh once = advance_front(points_m, 6);
  std::mt19937_64 random(1);
  std::vector<std::unique_ptr<std::vector<char>>> junk;
  for (int i = 0; i < 3000; ++i)
    junk.push_back(std::make_unique<std::vector<char>>(random() % 20000));
  for (std::size_t i = 0; i < junk.size(); i += 2) junk[i].reset();
  const FrontMesh again = advance_front(points_m, 6);
  EXPECT_EQ(once.mesh.triangles, again.mesh.triangles);
  EXPECT_EQ(once.sources, again.sources);
}

// Tie-breaking and memory are kept per thread: a nested run must not affect the outer one, and an
// aborted run must leave nothing behind.
TEST(AdvancingFront, SameResultInsideAnotherRun) {
  Points points_m = grid_points(80, 0);
  for (const glm::dvec3& p : grid_points(70, 0.7)) points_m.push_back(p);
  const Points inner_m = grid_points(20, 0);
  const FrontMesh once = advance_front(points_m, 6), inner_once = advance_front(inner_m, 6);
  int runs = 0;
  const RunControl work{.progress = [&](double) {
    ++runs;
    EXPECT_EQ(advance_front(inner_m, 6).mesh.triangles, inner_once.mesh.triangles);
  }};
  EXPECT_EQ(advance_front(points_m, 6, {}, work).mesh.triangles, once.mesh.triangles);
  EXPECT_GT(runs, 1);
  const RunControl ended{.progress = [](double) { throw std::runtime_error("enough"); }};
  EXPECT_THROW(advance_front(points_m, 6, {}, ended), std::runtime_error);
  EXPECT_EQ(advance_front(inner_m, 6).mesh.triangles, inner_once.mesh.triangles);
}

TEST(AdvancingFront, RejectsInvalidInput) {
  const auto message = [](const Points& points_m, double limit_m, const Points& origins_m,
                          const RunControl& work) {
    try {
      advance_front(points_m, limit_m, origins_m, work);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  const Points points_m = ball_points(10);
  EXPECT_THAT(message(points_m, 0, {}, {}), HasSubstr("longest_perimeter_m = 0 must be positive"));
  EXPECT_THAT(message(points_m, std::nan(""), {}, {}), HasSubstr("= nan must be positive"));
  EXPECT_THAT(message(points_m, 3, Points(9), {}), HasSubstr("9 origins for 10 points"));
  EXPECT_THAT(message(points_m, 3, {}, {.most_bytes = 100}), HasSubstr("10 points take about"));
  EXPECT_THAT(message({{0, 0, 1e16}}, 3, {}, {}), HasSubstr("point 0 must be within 1e+15 m"));
}

// Each edge along one line forms a tetrahedron with each edge along the other.
TEST(AdvancingFront, RejectsLinesWithTooManyTetrahedra) {
  Points points_m;
  for (int i = 0; i < 500; ++i) {
    points_m.emplace_back(0.01 * i, 0, 0);
    points_m.emplace_back(0, 0.01 * i, 1);
  }
  try {
    advance_front(points_m, 3);
    FAIL() << "249 001 tetrahedra were linked";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("1000 points make more tetrahedra than fit into 9 MB"));
  }
  const Points ball_m = ball_points(100);  // the refused run leaves nothing behind
  EXPECT_EQ(testing::euler_number(advance_front(ball_m, 3).mesh), 2);
}

TEST(AdvancingFront, ReportsProgressAndStopsOnRequest) {
  const Points points_m = ball_points(20000);
  std::vector<double> shares;
  advance_front(points_m, 3, {}, {.progress = [&](double share) { shares.push_back(share); }});
  ASSERT_GT(shares.size(), 2u);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_EQ(shares.back(), 1);
  const RunControl work{.progress = [](double) { throw std::runtime_error("enough"); }};
  EXPECT_THROW(advance_front(points_m, 3, {}, work), std::runtime_error);
}

}  // namespace
}  // namespace groundray::advancing_front_test
