#include "reconstruction/mesh/accuracy/agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/tracing/closest_point.h"
#include "reconstruction/mesh/accuracy/accuracy.h"
#include "test/support/scans/solid.h"

namespace groundray::agreement_test {
namespace {

using ::testing::HasSubstr;
using testing::icosphere;
using Random = std::mt19937_64;

// Strip of squares that rises by `rise` per metre of x.
TriangleMesh strip(double begin_m, unsigned squares, double rise = 0) {
  TriangleMesh mesh;
  for (unsigned i = 0; i <= squares; ++i) {
    for (const double y : {0.0, 1.0}) mesh.vertices_m.emplace_back(begin_m + i, y, rise * i);
    if (i == squares) break;
    mesh.triangles.insert(mesh.triangles.end(),
                          {{2 * i, 2 * i + 2, 2 * i + 1}, {2 * i + 1, 2 * i + 2, 2 * i + 3}});
  }
  return mesh;
}

void expect_share(const AreaShare& share, double truth, double tolerance) {
  EXPECT_LE(share.at_least, truth);
  EXPECT_GE(share.at_most, truth);
  EXPECT_NEAR(share.value, truth, tolerance);
  EXPECT_LE(share.at_most - share.at_least, 4 * tolerance);
}

// The part of a strip that does not overlap the other is as far from it as from its end, since both
// are equally wide.
TEST(Agreement, OverlappingStripsAgreeWhereTheyOverlap) {
  const TriangleMesh truth = strip(0, 10), mesh = strip(4, 8);
  const std::vector<double> tolerances_m{0.05, 1, 1.7};
  const auto found = agreement(mesh, truth, tolerances_m);
  for (std::size_t k = 0; k < 3; ++k) {
    const double t = tolerances_m[k];
    EXPECT_EQ(found[k].tolerance_m, t);
    // The boundary crosses some of about 1e5 parts, quartered twice: 1e-2 m wide, of 10 m.
    expect_share(found[k].precision, (6 + t) / 8, 1e-3);
    expect_share(found[k].completeness, (6 + t) / 10, 1e-3);
    const AreaShare f1 = found[k].f1();
    expect_share(f1, 2 * (6 + t) / 18, 1e-3);
  }
}

// A slope of angle a is x sin(a) from the plane at a length of x along the slope.
TEST(Agreement, ASlopeAgreesUpToTheTolerance) {
  const TriangleMesh slope = strip(0, 6, 0.3), plane = strip(-20, 50);
  const double sine = 0.3 / std::hypot(1, 0.3), length_m = 6 * std::hypot(1, 0.3);
  const MeshDistance distance(slope, plane);
  for (const unsigned quarterings : {0u, 1u, 3u}) {
    const auto found = distance.within(std::vector{0.1, 0.9, 1.5, 2.0},
                                       {.step_m = 0.1, .quarterings = quarterings});
    const double tolerance = 0.1 / length_m / std::exp2(quarterings);  // one row of parts
    expect_share(found[0], 0.1 / sine / length_m, tolerance);
    expect_share(found[1], 0.9 / sine / length_m, tolerance);
    expect_share(found[2], 1.5 / sine / length_m, tolerance);
    EXPECT_EQ(found[3].value, 1);
    EXPECT_NEAR(found[3].at_least, 1, 1e-9);
  }
}

// The balls' facets have the same shape; at corners those of the inner ball are 0.1 m from those of
// the outer.
TEST(Agreement, BallsAgreeOnlyAboveTheirGap) {
  const TriangleMesh inner = icosphere(1, 2).mesh, outer = icosphere(1.1, 2).mesh;
  const auto found = agreement(inner, outer, std::vector{0.09, 0.11}, {.step_m = 0.05});
  EXPECT_LT(found[0].precision.at_most, 1e-9);
  EXPECT_LT(found[0].completeness.at_most, 1e-9);
  EXPECT_EQ(found[0].f1().value, 0);
  EXPECT_GE(found[1].precision.at_least, 1 - 1e-9);
  EXPECT_GE(found[1].completeness.at_least, 1 - 1e-9);
}

TEST(Agreement, WeightsSelectPartsOfTheReference) {
  const TriangleMesh truth = strip(0, 10), mesh = strip(0, 6);
  const std::vector<double> tolerances_m{0.5};
  const auto completeness = [&](const SurfaceWeight& weight) {
    return agreement(mesh, truth, tolerances_m, {.step_m = 0.05}, weight).at(0).completeness;
  };
  expect_share(completeness([](std::uint32_t, const glm::dvec3& p) { return p.x < 5 ? 2.0 : 0; }),
               1, 1e-3);
  expect_share(completeness([](std::uint32_t, const glm::dvec3& p) { return p.x > 5 ? 0.1 : 0; }),
               1.5 / 5, 1e-3);
  // The same selection by triangle number: two triangles per metre.
  expect_share(completeness([](std::uint32_t i, const glm::dvec3&) { return i >= 10 ? 1.0 : 0; }),
               1.5 / 5, 1e-3);
  // 6.5 m count, those before 5 m with weight 3.
  expect_share(completeness([](std::uint32_t i, const glm::dvec3&) { return i < 10 ? 3.0 : 1; }),
               (15 + 1.5) / 20, 1e-3);
}

// Oracle: random points by area, and distances to all triangles.
TEST(Agreement, MatchesRandomPointsForRandomTriangles) {
  Random random(5);
  std::uniform_real_distribution<double> place(-1, 1), share(0, 1);
  const auto soup = [&] {
    TriangleMesh mesh;
    for (unsigned i = 0; i < 30; ++i) {
      for (int k = 0; k < 3; ++k) {
        const double x = place(random), y = place(random);
        mesh.vertices_m.emplace_back(x, y, 0.3 * place(random));
      }
      mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return mesh;
  };
  const TriangleMesh from = soup(), to = soup();
  const std::vector<double> tolerances_m{0.03, 0.1};
  const auto found = MeshDistance(from, to).within(tolerances_m, {.step_m = 0.03});
  std::vector<double> areas;
  for (const glm::uvec3& t : from.triangles) {
    const glm::dvec3 a = from.vertices_m[t.x];
    areas.push_back(glm::length(glm::cross(from.vertices_m[t.y] - a, from.vertices_m[t.z] - a)));
  }
  std::discrete_distribution<std::size_t> pick(areas.begin(), areas.end());
  constexpr int count = 20'000;
  std::vector<double> within(2);
  for (int i = 0; i < count; ++i) {
    const glm::uvec3& t = from.triangles[pick(random)];
    double u = share(random), v = share(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const glm::dvec3 p =
        (1 - u - v) * from.vertices_m[t.x] + u * from.vertices_m[t.y] + v * from.vertices_m[t.z];
    double least_m = 1e9;
    for (const glm::uvec3& other : to.triangles) {
      least_m = std::min(
          least_m, glm::length(vector_to_triangle(p, to.vertices_m[other.x], to.vertices_m[other.y],
                                                  to.vertices_m[other.z])));
    }
    for (std::size_t k = 0; k < 2; ++k) within[k] += least_m <= tolerances_m[k] ? 1.0 / count : 0;
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const double sigma = std::sqrt(within[k] * (1 - within[k]) / count);
    EXPECT_GT(within[k], 0.02);
    EXPECT_NEAR(found[k].value, within[k], 4 * sigma);
    EXPECT_LE(found[k].at_least, within[k] + 4 * sigma);
    EXPECT_GE(found[k].at_most, within[k] - 4 * sigma);
    EXPECT_LE(found[k].at_least, found[k].value);
    EXPECT_GE(found[k].at_most, found[k].value);
  }
}

TEST(Agreement, IsTheSameForAnyNumberOfThreads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 5);
  const TriangleMesh inner = icosphere(1, 1).mesh, outer = icosphere(1.03, 2).mesh;
  std::vector<Agreement> first;
  for (const int threads : {1, 2, 5}) {
    tbb::task_arena(threads).execute([&] {
      const auto found = agreement(inner, outer, std::vector{0.04, 0.07}, {.step_m = 0.02});
      if (first.empty()) first = found;
      for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_EQ(found[k].precision.value, first[k].precision.value);
        EXPECT_EQ(found[k].precision.at_least, first[k].precision.at_least);
        EXPECT_EQ(found[k].completeness.at_most, first[k].completeness.at_most);
      }
    });
  }
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

TEST(Agreement, ReportsInvalidInput) {
  const TriangleMesh mesh = strip(0, 2);
  const auto of = [&](std::vector<double> tolerances_m, const SurfaceWeight& weight = {}) {
    return message_of([&] { static_cast<void>(agreement(mesh, mesh, tolerances_m, {}, weight)); });
  };
  EXPECT_THAT(of({}), HasSubstr("at least one tolerance is required"));
  for (const double bad_m : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THAT(of({1, bad_m}), HasSubstr("must be positive and finite"));
  EXPECT_THAT(of({1}, [](std::uint32_t, const glm::dvec3&) { return 0.0; }),
              HasSubstr("the weighted area of the surface is 0"));
  for (const double bad : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(of({1}, [bad](std::uint32_t, const glm::dvec3&) { return bad; }),
                HasSubstr("negative or not finite"));
  }
  EXPECT_THAT(message_of([&] {
                static_cast<void>(agreement(mesh, mesh, std::vector{1.0}, {.quarterings = 13}));
              }),
              HasSubstr("quarterings = 13 must be at most 12"));
  EXPECT_THAT(
      message_of([&] { static_cast<void>(agreement(mesh, TriangleMesh{}, std::vector{1.0})); }),
      HasSubstr("there is no triangle"));
}

}  // namespace
}  // namespace groundray::agreement_test
