#include "reconstruction/mesh/accuracy/true_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "test/support/scans/solid.h"

namespace groundray::true_surface_test {
namespace {

using ::testing::HasSubstr;
using testing::icosphere;
using Random = std::mt19937_64;

// Square grid from (0, 0) to (side, side).
TriangleMesh grid(unsigned cells, double side_m,
                  const std::function<double(double, double)>& height_m) {
  TriangleMesh mesh;
  for (unsigned row = 0; row <= cells; ++row) {
    for (unsigned column = 0; column <= cells; ++column) {
      const double x = side_m * column / cells, y = side_m * row / cells;
      mesh.vertices_m.emplace_back(x, y, height_m(x, y));
      if (row == cells || column == cells) continue;
      const unsigned a = row * (cells + 1) + column, c = a + cells + 1;
      mesh.triangles.insert(mesh.triangles.end(), {{a, a + 1, c}, {a + 1, c + 1, c}});
    }
  }
  return mesh;
}

void expect_bounded(const BoundedLength& length, double truth_m, double tolerance_m) {
  EXPECT_LE(length.at_least_m, truth_m);
  EXPECT_GE(length.at_most_m, truth_m);
  EXPECT_NEAR(length.value_m, truth_m, tolerance_m);
}

void expect_largest(const TrueDistance& found, double truth_m) {
  EXPECT_LE(found.at_least_m, truth_m * (1 + 1e-12));
  EXPECT_GE(found.at_most_m, truth_m);
  EXPECT_LE(found.at_most_m, 1.011 * found.at_least_m);
}

// A slope from 0 to 3 over 4 m: its distances from the plane are those heights, evenly distributed.
TEST(TrueDistance, DistanceOfASlopeFromAPlaneIsItsHeight) {
  const TriangleMesh slope = grid(4, 4, [](double x, double) { return 0.75 * x; });
  const std::vector<double> tolerances_m{0.6, 2.4};
  const TrueDistance found = true_distance(slope, true_plane({7, 8, 0}, {0, 0, 0.1}), tolerances_m);
  expect_largest(found, 3);
  expect_bounded(found.mean, 1.5, 1e-3);
  expect_bounded(found.rms, std::sqrt(3.0), 1e-3);
  EXPECT_NEAR(found.area_m2, 20, 1e-9);
  for (std::size_t k = 0; k < 2; ++k) {
    const double truth = tolerances_m[k] / 3;
    EXPECT_LE(found.within[k].at_least, truth);
    EXPECT_GE(found.within[k].at_most, truth);
    EXPECT_NEAR(found.within[k].value, truth, 2e-3);
    EXPECT_LE(found.within[k].at_most - found.within[k].at_least, 4e-3);
  }
  EXPECT_NEAR(found.turn.mean_rad(), std::atan(0.75), 1e-12);
  EXPECT_NEAR(found.turn.rms_rad(), std::atan(0.75), 1e-12);
}

// Corners lie on the sphere. A facet is farthest where it is nearest to the centre, at its
// circumcentre, which lies within each facet of such a ball.
TEST(TrueDistance, BallsAreFarthestFromTheirSphereInsideFacets) {
  const glm::dvec3 centre_m(3, -5, 100);
  TriangleMesh ball = icosphere(2, 2).mesh;
  double largest_m = 0;
  for (const glm::uvec3& t : ball.triangles) {
    const glm::dvec3 a = ball.vertices_m[t.x];
    const glm::dvec3 normal =
        glm::normalize(glm::cross(ball.vertices_m[t.y] - a, ball.vertices_m[t.z] - a));
    largest_m = std::max(largest_m, 2 - glm::dot(a, normal));
  }
  for (glm::dvec3& p : ball.vertices_m) p += centre_m;
  const TrueDistance found = true_distance(ball, true_sphere(centre_m, 2), {}, {.step_m = 0.01});
  expect_largest(found, largest_m);
  EXPECT_TRUE(found.within.empty());
  EXPECT_GT(found.turn.mean_rad(), 0);
  // The sphere's normal at the foot point of a facet's point differs from the facet's by the angle
  // between the facet's normal and the point's direction from the centre.
  Random random(3);
  std::uniform_real_distribution<double> share(0, 1);
  double distance = 0, turn = 0, area = 0;
  constexpr int count = 400;
  for (const glm::uvec3& t : ball.triangles) {
    const glm::dvec3 a = ball.vertices_m[t.x] - centre_m, b = ball.vertices_m[t.y] - centre_m,
                     c = ball.vertices_m[t.z] - centre_m, cross = glm::cross(b - a, c - a);
    for (int i = 0; i < count; ++i) {
      double u = share(random), v = share(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const glm::dvec3 p = a + u * (b - a) + v * (c - a);
      distance += (2 - glm::length(p)) * glm::length(cross);
      turn +=
          std::acos(glm::dot(p, cross) / glm::length(p) / glm::length(cross)) * glm::length(cross);
    }
    area += count * glm::length(cross);
  }
  // 128 000 random points; the standard deviation of either quantity is less than half its mean.
  EXPECT_NEAR(found.mean.value_m, distance / area, 4 * 0.5 * distance / area / std::sqrt(128e3));
  EXPECT_NEAR(found.turn.mean_rad(), turn / area, 4 * 0.5 * turn / area / std::sqrt(128e3));
}

// A plane tangent to a cylinder along the line x = 0 is hypot(x, r) - r from it.
TEST(TrueDistance, DistanceOfAPlaneFromACylinderFollowsPythagoras) {
  const TriangleMesh plane = grid(3, 3, [](double, double) { return 0.0; });
  const TrueDistance found =
      true_distance(plane, true_cylinder({0, 55, -4}, {0, 3, 0}, 4), std::vector{0.5});
  expect_largest(found, 1);
  // The integral of hypot over 0 to 3 is (15 + 16 asinh(3/4)) / 2.
  expect_bounded(found.mean, (15 + 16 * std::asinh(0.75)) / 6 - 4, 1e-4);
  EXPECT_NEAR(found.within[0].value, std::sqrt(4.5 * 4.5 - 16) / 3, 1e-3);
  EXPECT_NEAR(found.turn.largest_rad(), std::atan(0.75), 2e-3);
}

TEST(TrueDistance, DistanceOfALiftedGridFromItsHeightsIsTheLift) {
  const auto height = [](double x, double y) { return 0.5 * std::sin(x) + 0.2 * y; };
  const TrueSurface truth = true_heights(height, std::hypot(0.5, 0.2), [](double x, double) {
    return glm::dvec2(0.5 * std::cos(x), 0.2);
  });
  const TriangleMesh lifted = grid(200, 4, [&](double x, double y) { return height(x, y) + 0.01; });
  const TrueDistance found =
      true_distance(lifted, truth, std::vector{0.009, 0.011}, {.step_m = 0.02});
  // Chords of 0.02 m deviate by 0.5 * 0.02^2 / 8 = 2.5e-5 m.
  EXPECT_NEAR(found.at_least_m, 0.01, 3e-5);
  EXPECT_NEAR(found.mean.value_m, 0.01, 3e-5);
  EXPECT_EQ(found.within[0].value, 0);
  EXPECT_EQ(found.within[1].value, 1);
  EXPECT_LT(found.turn.largest_rad(), 0.01);
}

TEST(TrueDistance, IsZeroOnTheSurface) {
  const TriangleMesh plane = grid(3, 3, [](double, double) { return 0.0; });
  const TrueDistance found = true_distance(plane, true_plane({0, 0, 0}, {0, 0, 1}));
  EXPECT_EQ(found.at_least_m, 0);
  EXPECT_EQ(found.mean.value_m, 0);
  EXPECT_LT(found.at_most_m, 0.01);  // the distance is unknown between samples
  EXPECT_EQ(found.turn.largest_rad(), 0);
}

TEST(TrueDistance, IsTheSameForAnyNumberOfThreads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 5);
  const TriangleMesh ball = icosphere(2, 3).mesh;
  const auto measure = [&](int threads) {
    TrueDistance found;
    tbb::task_arena(threads).execute([&] {
      found = true_distance(ball, true_sphere({0, 0, 0.01}, 2), std::vector{0.01, 0.02},
                            {.step_m = 0.1});
    });
    return found;
  };
  const TrueDistance first = measure(1), second = measure(4);
  EXPECT_EQ(first.at_least_m, second.at_least_m);
  EXPECT_EQ(first.at_most_m, second.at_most_m);
  EXPECT_EQ(first.mean.value_m, second.mean.value_m);
  EXPECT_EQ(first.within[0].value, second.within[0].value);
  EXPECT_EQ(first.turn.rms_rad(), second.turn.rms_rad());
}

template <typename F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "no Error was thrown";
}

TEST(TrueDistance, ReportsInvalidInput) {
  const TriangleMesh plane = grid(1, 1, [](double, double) { return 0.0; });
  const auto of = [&](const TriangleMesh& mesh, const TrueSurface& truth) {
    return message_of([&] { static_cast<void>(true_distance(mesh, truth)); });
  };
  const TrueSurface sphere = true_sphere({0, 0, 0}, 1);
  EXPECT_THAT(of({}, sphere), HasSubstr("mesh: there is no triangle"));
  EXPECT_THAT(of(plane, {}), HasSubstr("distance_m must be given"));
  EXPECT_THAT(of({{{0, 0, 0}, {1, 0, 0}}, {{0, 1, 1}}, {}}, sphere),
              HasSubstr("all triangles are degenerate"));
  TrueSurface bad = sphere;
  bad.distance_m = [](const glm::dvec3&) { return -1.0; };
  EXPECT_THAT(of(plane, bad), HasSubstr("is -1; it must be 0 or more"));
  bad.distance_m = [](const glm::dvec3&) { return std::nan(""); };
  EXPECT_THAT(of(plane, bad), HasSubstr("is nan; it must be 0 or more"));
  bad.most_change = 0;
  EXPECT_THAT(of(plane, bad), HasSubstr("most_change = 0 must be positive"));
  EXPECT_THAT(message_of([] { true_sphere({0, 0, 0}, 0); }), HasSubstr("radius_m = 0"));
  EXPECT_THAT(message_of([] { true_plane({0, 0, 0}, {0, 0, 0}); }), HasSubstr("normal = 0 0 0"));
  EXPECT_THAT(message_of([] { true_cylinder({0, 0, 0}, {0, 0, 0}, 1); }), HasSubstr("axis = 0"));
  EXPECT_THAT(message_of([] { true_heights({}, -1); }), HasSubstr("steepest = -1"));
}

}  // namespace
}  // namespace groundray::true_surface_test
