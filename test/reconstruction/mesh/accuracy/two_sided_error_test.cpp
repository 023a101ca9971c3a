#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "reconstruction/mesh/accuracy/agreement.h"
#include "test/support/scans/solid.h"

namespace groundray::two_sided_error_test {
namespace {

using testing::box_model;
using ::testing::HasSubstr;
using testing::icosphere;
using Random = std::mt19937_64;

TriangleMesh soup(unsigned triangles, Random& random) {
  std::uniform_real_distribution<double> place(-1, 1);
  TriangleMesh mesh;
  for (unsigned i = 0; i < triangles; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double x = place(random), y = place(random);
      mesh.vertices_m.emplace_back(x, y, place(random));
    }
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

// A box within a box: all of the inner one is 1 m from the outer one; the outer one's faces are 1 m
// and more from the inner one, and its corners farthest.
TEST(TwoSidedError, BoxInABoxErrsMostAtTheCorners) {
  const TriangleMesh inner = box_model({2, 2, 2}).mesh, outer = box_model({4, 4, 4}).mesh;
  const TwoSidedError error = two_sided_error(inner, outer, {.largest_share = 0.01});
  EXPECT_NEAR(error.forth.at_least_m, 1, 1e-9);
  EXPECT_NEAR(error.forth.at_most_m, 1, 1e-9);
  EXPECT_NEAR(error.forth.mean.value_m, 1, 1e-9);
  EXPECT_NEAR(error.forth.rms.value_m, 1, 1e-9);
  EXPECT_LE(error.back.at_least_m, std::sqrt(3));
  EXPECT_GE(error.back.at_most_m, std::sqrt(3));
  EXPECT_GE(error.back.at_least_m, 0.99 * error.back.at_most_m);
  EXPECT_EQ(error.largest().at_most_m, error.back.at_most_m);
  EXPECT_EQ(error.mean_m(), error.back.mean.value_m);
  EXPECT_EQ(error.rms_m(), error.back.rms.value_m);
  // A quarter of a face is 1 m away, half of it hypot(1, s), and a quarter hypot(1, s, t), with s
  // and t from 0 to 1: the mean square is 1 + 1/2 * 1/3 + 1/4 * 2/3.
  EXPECT_NEAR(error.back.rms.value_m, std::sqrt(4.0 / 3), 1e-4);
  EXPECT_LE(error.back.rms.at_least_m, std::sqrt(4.0 / 3));
  EXPECT_GE(error.back.rms.at_most_m, std::sqrt(4.0 / 3));
}

TEST(TwoSidedError, AMeshAgreesWithItselfWithinRounding) {
  const TriangleMesh ball = icosphere(3, 3).mesh;
  const TwoSidedError error = two_sided_error(ball, ball);
  EXPECT_EQ(error.largest().at_least_m, 0);
  EXPECT_LT(error.largest().at_most_m, 1e-11);
  EXPECT_LT(error.mean_m(), 1e-12);
}

// For every requested tolerance the bounds enclose the result of a search to a far smaller one.
TEST(TwoSidedError, BoundsEncloseTheResultOfAFinerSearch) {
  Random random(8);
  for (int round = 0; round < 2; ++round) {
    const TriangleMesh first = soup(6, random), second = soup(20, random);
    const LargestDistance forth = MeshDistance(first, second).largest(1e-4);
    const LargestDistance back = MeshDistance(second, first).largest(1e-4);
    for (const double samples : {10.0, 3e3}) {
      for (const double share : {0.5, 0.03}) {
        const ErrorFineness fineness{
            .samples = samples, .largest_share = share, .most_pieces = 1'000'000};
        const TwoSidedError error = two_sided_error(first, second, fineness);
        EXPECT_LE(error.forth.at_least_m, forth.at_most_m);
        EXPECT_GE(error.forth.at_most_m, forth.at_least_m);
        EXPECT_GE(error.forth.at_least_m, (1 - share) * error.forth.at_most_m);
        EXPECT_LE(error.back.at_least_m, back.at_most_m);
        EXPECT_GE(error.back.at_most_m, back.at_least_m);
        EXPECT_GE(error.back.at_least_m, (1 - share) * error.back.at_most_m);
      }
      for (const std::size_t most : {0u, 3u, 50u}) {
        const ErrorFineness hasty{.samples = samples, .largest_share = 0.03, .most_pieces = most};
        const TwoSidedError error = two_sided_error(first, second, hasty);
        EXPECT_LE(error.forth.at_least_m, forth.at_most_m);
        EXPECT_GE(error.forth.at_most_m, forth.at_least_m);
      }
    }
  }
}

// Rough terrain against every fourth of its samples: errors are evenly distributed and small
// compared with the triangles.
TEST(TwoSidedError, BoundsAreTightForThinnedTerrain) {
  Random random(11);
  std::uniform_real_distribution<double> rough(-0.2, 0.2);
  constexpr unsigned cells = 48, each = 4;
  std::vector<double> heights_m(std::size_t{cells + 1} * (cells + 1));
  for (double& height_m : heights_m) height_m = rough(random);
  const auto terrain = [&](unsigned step) {
    TriangleMesh mesh;
    const unsigned count = cells / step;
    for (unsigned row = 0; row <= count; ++row) {
      for (unsigned column = 0; column <= count; ++column) {
        const unsigned x = column * step, y = row * step;
        mesh.vertices_m.emplace_back(x, y, 0.4 * x + heights_m[std::size_t{y} * (cells + 1) + x]);
        if (row == count || column == count) continue;
        const unsigned a = row * (count + 1) + column, c = a + count + 1;
        mesh.triangles.insert(mesh.triangles.end(), {{a, a + 1, c}, {a + 1, c + 1, c}});
      }
    }
    return mesh;
  };
  const TriangleMesh fine = terrain(1), thinned = terrain(each);
  const LargestDistance forth = MeshDistance(fine, thinned).largest(1e-4);
  const LargestDistance back = MeshDistance(thinned, fine).largest(1e-4);
  for (const std::size_t most : {0u, 50'000u}) {
    const TwoSidedError error =
        two_sided_error(fine, thinned, {.samples = 2e4, .most_pieces = most});
    EXPECT_LE(error.forth.at_least_m, forth.at_most_m);
    EXPECT_GE(error.forth.at_most_m, forth.at_least_m);
    EXPECT_LE(error.back.at_least_m, back.at_most_m);
    EXPECT_GE(error.back.at_most_m, back.at_least_m);
    EXPECT_LT(error.back.at_most_m, 1.2 * back.at_least_m);  // its covering triangles are near
    if (most == 0) continue;
    EXPECT_GE(error.forth.at_least_m, 0.95 * error.forth.at_most_m);
    EXPECT_GE(error.back.at_least_m, 0.95 * error.back.at_most_m);
  }
}

TEST(TwoSidedError, IsTheSameForPreparedMeshes) {
  Random random(9);
  const TriangleMesh first = soup(10, random), second = soup(10, random);
  const TwoSidedError error = two_sided_error(first, second);
  const TwoSidedError ready = two_sided_error(ClosestPoint(first), ClosestPoint(second));
  // The frames differ, and so does the rounding.
  EXPECT_NEAR(ready.forth.mean.value_m, error.forth.mean.value_m, 1e-12);
  EXPECT_NEAR(ready.back.rms.value_m, error.back.rms.value_m, 1e-12);
  EXPECT_NEAR(ready.back.at_least_m, error.back.at_least_m, 0.2 * error.back.at_most_m);
}

TEST(TwoSidedError, IsTheSameForAnyNumberOfThreads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 5);
  Random random(10);
  const TriangleMesh first = soup(20, random), second = soup(20, random);
  const auto measure = [&](int threads) {
    TwoSidedError error;
    tbb::task_arena(threads).execute(
        [&] { error = two_sided_error(first, second, {.samples = 1e4}); });
    return error;
  };
  const TwoSidedError one = measure(1), five = measure(5);
  EXPECT_EQ(one.forth.at_least_m, five.forth.at_least_m);
  EXPECT_EQ(one.forth.at_most_m, five.forth.at_most_m);
  EXPECT_EQ(one.back.at_least_m, five.back.at_least_m);
  EXPECT_EQ(one.back.at_most_m, five.back.at_most_m);
  EXPECT_EQ(one.mean_m(), five.mean_m());
  EXPECT_EQ(one.rms_m(), five.rms_m());
}

// A fan of needles, and a triangle of zero area that is far longer than the others.
TEST(TwoSidedError, NeedlesAreMeasuredInReasonableTime) {
  constexpr unsigned count = 150'000;
  TriangleMesh disc{{{0, 0, 0}}, {}, {}};
  for (unsigned i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    disc.vertices_m.emplace_back(std::cos(angle), std::sin(angle), 0);
    disc.triangles.emplace_back(0, 1 + i, 1 + (i + 1) % count);
  }
  const TriangleMesh plate{
      {{-1, -1, 0.5}, {1, -1, 0.5}, {1, 1, 0.5}, {-1, 1, 0.5}}, {{0, 1, 2}, {0, 2, 3}}, {}};
  const OneSidedError fan = MeshDistance(disc, plate).error();
  EXPECT_LE(fan.mean.at_least_m, 0.5);
  EXPECT_GE(fan.mean.at_most_m, 0.5);
  EXPECT_NEAR(fan.mean.value_m, 0.5, 1e-9);
  EXPECT_NEAR(fan.at_most_m, 0.5, 1e-9);
  TriangleMesh spiked = plate;
  for (glm::dvec3& p_m : spiked.vertices_m) p_m.z = 0;
  spiked.vertices_m.insert(spiked.vertices_m.end(), {{5000, -1, 0}, {10000, -1, 0}});
  spiked.triangles.emplace_back(0, 4, 5);
  const OneSidedError spike = MeshDistance(spiked, plate).error();
  const double far_m = std::hypot(9999, 0.5);  // from the plate's corner
  EXPECT_LE(spike.at_least_m, far_m + 1e-9);
  EXPECT_GE(spike.at_most_m, far_m - 1e-9);
  EXPECT_GE(spike.at_least_m, 0.9 * far_m);
  EXPECT_NEAR(spike.mean.value_m, 0.5, 1e-9);
}

TEST(TwoSidedError, ReportsInvalidInput) {
  const TriangleMesh ball = icosphere(1, 0).mesh;
  const auto message = [&](const TriangleMesh& mesh, const ErrorFineness& fineness) -> std::string {
    try {
      static_cast<void>(two_sided_error(mesh, ball, fineness));
    } catch (const Error& error) {
      return error.what();
    }
    return "no Error was thrown";
  };
  EXPECT_THAT(message({}, {}), HasSubstr("there is no triangle"));
  EXPECT_THAT(message({{{0, 0, 0}, {1, 0, 0}}, {{0, 1, 1}}, {}}, {}), HasSubstr("degenerate"));
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    EXPECT_THAT(message(ball, {.samples = bad}), HasSubstr("must be positive"));
    EXPECT_THAT(message(ball, {.largest_share = bad}), HasSubstr("largest_share"));
  }
  EXPECT_THAT(message(ball, {.largest_share = 1}), HasSubstr("between 0 and 1"));
}

}  // namespace
}  // namespace groundray::two_sided_error_test
