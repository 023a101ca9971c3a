#include "reconstruction/mesh/accuracy/accuracy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/geometry/pose.h"
#include "test/support/scans/solid.h"

namespace groundray::accuracy_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using Random = std::mt19937_64;

// Rectangle of cells with its low corner at `low`; `diagonal` selects the direction of the cells'
// diagonals.
TriangleMesh plane(const glm::dvec3& low, glm::dvec2 size_m, glm::ivec2 cells, int diagonal = 0) {
  TriangleMesh mesh;
  for (int row = 0; row <= cells.y; ++row) {
    for (int column = 0; column <= cells.x; ++column)
      mesh.vertices_m.push_back(
          low + glm::dvec3(column * size_m.x / cells.x, row * size_m.y / cells.y, 0));
  }
  for (int row = 0; row < cells.y; ++row) {
    for (int column = 0; column < cells.x; ++column) {
      const auto a = static_cast<unsigned>(row * (cells.x + 1) + column), b = a + 1;
      const auto c = a + static_cast<unsigned>(cells.x) + 1, d = c + 1;
      if (diagonal == 0) {
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {b, d, c}});
      } else {
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, d}, {a, d, c}});
      }
    }
  }
  return mesh;
}

TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto first = static_cast<unsigned>(a.vertices_m.size());
  a.vertices_m.insert(a.vertices_m.end(), b.vertices_m.begin(), b.vertices_m.end());
  for (const glm::uvec3& t : b.triangles) a.triangles.push_back(t + first);
  return a;
}

TriangleMesh moved(TriangleMesh mesh, const Pose& X_WM) {
  for (glm::dvec3& p : mesh.vertices_m) p = X_WM * p;
  return mesh;
}

// Plane of 2 m sides about the origin with a pyramid of the given height on its middle square.
TriangleMesh bumpy(double height_m) {
  TriangleMesh mesh = plane({-1, -1, 0}, {2, 2}, {4, 4});
  mesh.vertices_m[12].z = height_m;
  // Four sides of the pyramid: the diagonals of its cells must all begin at the apex.
  mesh.triangles.clear();
  for (unsigned row = 0; row < 4; ++row) {
    for (unsigned column = 0; column < 4; ++column) {
      const unsigned a = 5 * row + column, b = a + 1, c = a + 5, d = c + 1;
      if (a == 12 || d == 12) {
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, d}, {a, d, c}});
      } else {
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {b, d, c}});
      }
    }
  }
  return mesh;
}

TriangleMesh soup(int triangles, Random& random) {
  std::uniform_real_distribution<double> place(-1, 1);
  const auto within = [&](double half_m) {
    const double x = place(random), y = place(random);
    return half_m * glm::dvec3(x, y, place(random));
  };
  TriangleMesh mesh;
  for (int i = 0; i < triangles; ++i) {
    const glm::dvec3 middle = within(1);
    const auto first = static_cast<unsigned>(mesh.vertices_m.size());
    for (int k = 0; k < 3; ++k) mesh.vertices_m.push_back(middle + within(0.4));
    mesh.triangles.emplace_back(first, first + 1, first + 2);
  }
  return mesh;
}

double brute_force_m(const glm::dvec3& p, const TriangleMesh& mesh) {
  double least_m = std::numeric_limits<double>::infinity();
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 to =
        vector_to_triangle(p, mesh.vertices_m[t.x], mesh.vertices_m[t.y], mesh.vertices_m[t.z]);
    least_m = std::min(least_m, glm::length(to));
  }
  return least_m;
}

void expect_enclosed(const LargestDistance& found, double truth_m, double tolerance_m) {
  EXPECT_LE(found.at_least_m, truth_m);
  EXPECT_GE(found.at_most_m, truth_m);
  EXPECT_LE(found.at_most_m - found.at_least_m, tolerance_m);
  EXPECT_NEAR(glm::length(found.to - found.from), found.at_least_m, 1e-9);
}

TEST(MeshDistance, ParallelPlanesAreTheirGapApartForAnyTiling) {
  const TriangleMesh below = plane({0, 0, 0}, {10, 10}, {37, 23});
  for (const double gap_m : {0.0, 1e-6, 0.3, 20.0}) {
    const TriangleMesh above = plane({0, 0, gap_m}, {10, 10}, {29, 31}, 1);
    for (const auto& distance : {MeshDistance(above, below), MeshDistance(below, above)}) {
      const LargestDistance found = distance.largest(1e-9);
      EXPECT_NEAR(found.at_least_m, gap_m, 1e-9);
      EXPECT_LE(found.at_least_m, gap_m);
      EXPECT_GE(found.at_most_m, gap_m);
      // Some ten pieces for each intersection of two tiles, whatever the tolerance.
      EXPECT_LT(found.pieces, 150'000u) << gap_m;
      const MeanDistance mean = distance.mean(0.5);
      EXPECT_NEAR(mean.mean.value_m, gap_m, 1e-12 + 1e-12 * gap_m);
      EXPECT_NEAR(mean.rms.value_m, gap_m, 1e-12 + 1e-12 * gap_m);
      EXPECT_NEAR(mean.turn.mean_rad(), 0, 1e-12);
      EXPECT_NEAR(mean.area_m2, 100, 1e-9);
    }
  }
}

// The plane's centre is farthest from the pyramid's sides, h w / sqrt(h^2 + w^2) for a base of 2 w;
// no vertex of the plane is near it.
TEST(MeshDistance, LargestDistanceToABumpIsInsideAFace) {
  for (const double h : {0.01, 0.3, 2.0}) {
    const TriangleMesh flat = plane({-1, -1, 0}, {2, 2}, {1, 1}), bump = bumpy(h);
    const LargestDistance there = MeshDistance(flat, bump).largest(1e-7);
    expect_enclosed(there, h * 0.5 / std::hypot(h, 0.5), 1e-7);
    EXPECT_NEAR(glm::length(there.from), 0, 1e-6 / h);
    const LargestDistance back = MeshDistance(bump, flat).largest(1e-7);
    expect_enclosed(back, h, 1e-7);
    EXPECT_EQ(back.from, glm::dvec3(0, 0, h));
    expect_enclosed(
        {hausdorff(there, back).at_least_m, hausdorff(there, back).at_most_m, back.from, back.to},
        h, 1e-7);
  }
}

TEST(MeshDistance, IsOneSided) {
  const TriangleMesh small = plane({0, 0, 0}, {4, 4}, {5, 7});
  const TriangleMesh large = plane({-1, 0, 0}, {7, 5}, {3, 3});
  EXPECT_LE(MeshDistance(small, large).largest(1e-9).at_most_m, 1e-9);
  const LargestDistance found = MeshDistance(large, small).largest(1e-9);
  expect_enclosed(found, std::hypot(2, 1), 1e-9);
  EXPECT_NEAR(glm::length(found.from - glm::dvec3(6, 5, 0)), 0, 1e-12);
}

// The points of a wall between floor and ceiling that are farthest from both lie along a line at
// half its height.
TEST(MeshDistance, LargestDistanceBetweenTwoSurfacesIsHalfTheirGap) {
  const Pose upright{rotation_from_yaw_pitch_roll(0.3, 0, std::numbers::pi / 2), {3, 3, 0}};
  const TriangleMesh wall = moved(plane({0, 0, 0}, {4, 3}, {2, 1}), upright);
  const TriangleMesh rooms =
      joined(plane({0, 0, 0}, {10, 10}, {1, 1}), plane({0, 0, 3}, {10, 10}, {1, 1}));
  const LargestDistance found = MeshDistance(wall, rooms).largest(1e-9);
  expect_enclosed(found, 1.5, 1e-9);
  EXPECT_LT(found.pieces, 1000u);
}

TEST(MeshDistance, DistanceOfBallsIsBoundedByThatOfTheirSpheres) {
  const auto depth_m = [](const TriangleMesh& ball, double radius_m) {
    double depth = 0;
    for (const glm::uvec3& t : ball.triangles) {
      const auto& at = ball.vertices_m;
      const glm::dvec3 n = glm::normalize(glm::cross(at[t.y] - at[t.x], at[t.z] - at[t.x]));
      depth = std::max(depth, radius_m - glm::dot(n, at[t.x]));
    }
    return depth;
  };
  const TriangleMesh inner = testing::icosphere(1, 4).mesh, outer = testing::icosphere(1.5, 3).mesh;
  const double inner_depth_m = depth_m(inner, 1), outer_depth_m = depth_m(outer, 1.5);
  for (const auto& distance : {MeshDistance(inner, outer), MeshDistance(outer, inner)}) {
    const LargestDistance found = distance.largest(1e-6);
    EXPECT_GE(found.at_most_m, 0.5 - outer_depth_m);
    EXPECT_LE(found.at_least_m, 0.5 + inner_depth_m);
    EXPECT_LE(found.at_most_m - found.at_least_m, 1e-6);
    const MeanDistance mean = distance.mean(0.05);
    EXPECT_GT(mean.mean.value_m, 0.5 - outer_depth_m);
    EXPECT_LT(mean.mean.value_m, 0.5 + inner_depth_m);
    EXPECT_LT(mean.turn.mean_rad(), 0.2);
  }
}

// Dense lattice samples over each triangle: none exceeds the upper bound, and the lower bound
// exceeds their largest by at most the largest distance of a point from its nearest sample.
TEST(MeshDistance, MatchesDenseSamplesForTriangleSoups) {
  Random random(11);
  for (int round = 0; round < 6; ++round) {
    const TriangleMesh from = soup(12, random), to = soup(30, random);
    const MeshDistance distance(from, to);
    const LargestDistance found = distance.largest(1e-6);
    EXPECT_LE(found.at_most_m - found.at_least_m, 1e-6);
    EXPECT_NEAR(brute_force_m(found.from, to), found.at_least_m, 1e-12);
    constexpr int splits = 60;
    double largest_m = 0, spacing_m = 0, mean_m3 = 0, area_m2 = 0;
    for (const glm::uvec3& t : from.triangles) {
      const glm::dvec3 a = from.vertices_m[t.x], ab = from.vertices_m[t.y] - a,
                       ac = from.vertices_m[t.z] - a;
      spacing_m = std::max({spacing_m, glm::length(ab) / splits, glm::length(ac) / splits,
                            glm::length(ac - ab) / splits});
      const double part_m2 = glm::length(glm::cross(ab, ac)) / 2 / (splits * splits);
      for (double i = 0; i <= splits; ++i) {
        for (double j = 0; i + j <= splits; ++j) {
          const double d_m = brute_force_m(a + (i * ab + j * ac) / double{splits}, to);
          largest_m = std::max(largest_m, d_m);
          // Trapezoidal rule: a corner, edge or inner point is a corner of one, three or six parts.
          const int zeros = (i == 0) + (j == 0) + (i + j == splits);
          mean_m3 += part_m2 / 3 * (zeros == 2 ? 1 : zeros == 1 ? 3 : 6) * d_m;
        }
      }
      area_m2 += part_m2 * splits * splits;
    }
    EXPECT_LE(largest_m, found.at_most_m);
    EXPECT_LE(found.at_least_m, largest_m + spacing_m / std::numbers::sqrt3);
    const MeanDistance coarse = distance.mean(0.2), fine = distance.mean(0.01);
    for (const auto length : {&MeanDistance::mean, &MeanDistance::rms}) {
      for (const MeanDistance& mean : {coarse, fine}) {
        EXPECT_LE((mean.*length).at_least_m, (fine.*length).value_m + 1e-4);
        EXPECT_GE((mean.*length).at_most_m, (fine.*length).value_m - 1e-4);
      }
      EXPECT_NEAR((coarse.*length).value_m, (fine.*length).value_m, 0.02);
      // A part's radius of gyration is at most 0.29 steps.
      EXPECT_GT((fine.*length).at_least_m, (fine.*length).value_m - 0.0029);
      EXPECT_LT((fine.*length).at_most_m, (fine.*length).value_m + 0.0029);
    }
    EXPECT_NEAR(fine.mean.value_m, mean_m3 / area_m2, 0.0029);
    for (const double d_m : fine.largest_m) EXPECT_LE(d_m, found.at_most_m);
    EXPECT_NEAR(*std::ranges::max_element(fine.largest_m), found.at_least_m, 0.01);
  }
}

// A ramp that rises from 0 to h over a floor has a mean distance of h / 2 and a root mean square of
// h / sqrt(3), since equal heights have equal areas.
TEST(MeshDistance, MeansOnARampAreThoseOfALinearFunction) {
  const double slope_rad = 0.4, length_m = 3, height_m = length_m * std::sin(slope_rad);
  const TriangleMesh ramp = moved(plane({0, 0, 0}, {length_m, 2}, {3, 1}),
                                  {rotation_from_yaw_pitch_roll(0, -slope_rad, 0)});
  const MeshDistance distance(ramp, plane({-5, -5, 0}, {20, 20}, {1, 1}));
  for (const double step_m : {1.0, 0.3, 0.05}) {
    const MeanDistance mean = distance.mean(step_m, {height_m / 8, 8});
    // The distance is linear: a part's mean lies at its centroid, and the upper bounds are exact
    // except for the margin that covers rounding.
    EXPECT_NEAR(mean.mean.value_m, height_m / 2, 1e-12);
    EXPECT_NEAR(mean.mean.at_most_m, height_m / 2, 1e-11);
    EXPECT_NEAR(mean.rms.at_most_m, height_m / std::numbers::sqrt3, 1e-11);
    EXPECT_LE(mean.rms.value_m, mean.rms.at_most_m);
    for (const BoundedLength& length : {mean.mean, mean.rms}) {
      EXPECT_LE(length.at_least_m, length.value_m);
      EXPECT_GE(length.at_least_m, length.value_m - 0.29 * step_m);
    }
    EXPECT_NEAR(mean.turn.mean_rad(), slope_rad, 1e-12);
    double area_m2 = 0;
    for (const double bin_m2 : mean.bins_m2) area_m2 += bin_m2;
    EXPECT_NEAR(area_m2, length_m * 2, 1e-9);
    if (step_m > 0.1) continue;
    for (std::size_t k = 0; k < 8; ++k) EXPECT_NEAR(mean.bins_m2[k], length_m * 2 / 8, 0.15);
    EXPECT_EQ(mean.bins_m2[8], 0);
  }
}

// Within an equilateral triangle of inradius r, the distance to the boundary is r at the centre, r
// / 3 in the mean and r / sqrt(6) root mean square. The centre is the only sample of a large step,
// and the farthest point.
TEST(MeshDistance, BoundsEncloseTheMeansToTheBoundaryOfATriangle) {
  const TriangleMesh triangle{
      {{0, 0, 0}, {1, 0, 0}, {0.5, std::numbers::sqrt3 / 2, 0}}, {{0, 1, 2}}, {}};
  TriangleMesh rim = triangle;
  rim.triangles = {{0, 1, 1}, {1, 2, 2}, {2, 0, 0}};
  const double r_m = std::numbers::sqrt3 / 6;
  const MeshDistance distance(triangle, rim);
  expect_enclosed(distance.largest(1e-9), r_m, 1e-9);
  for (const double step_m : {1.0, 0.5, 0.2, 0.01}) {
    const MeanDistance mean = distance.mean(step_m);
    EXPECT_LE(mean.mean.at_least_m, r_m / 3);
    EXPECT_GE(mean.mean.at_most_m, r_m / 3);
    EXPECT_LE(mean.rms.at_least_m, r_m / std::sqrt(6));
    EXPECT_GE(mean.rms.at_most_m, r_m / std::sqrt(6));
    EXPECT_NEAR(mean.mean.value_m, r_m / 3, 0.29 * step_m);
    EXPECT_NEAR(mean.rms.value_m, r_m / std::sqrt(6), 0.29 * step_m);
  }
}

TEST(MeshDistance, DoesNotChangeWhenBothMeshesMove) {
  Random random(12);
  const TriangleMesh from = soup(20, random), to = soup(20, random);
  const LargestDistance here = MeshDistance(from, to).largest(1e-6);
  const MeanDistance mean = MeshDistance(from, to).mean(0.05);
  const Pose motion{rotation_from_yaw_pitch_roll(1, 0.4, -2), {435000, 5150500, 300}};
  const MeshDistance away(moved(from, motion), moved(to, motion));
  const LargestDistance there = away.largest(1e-6);
  constexpr double rounded_m = 4e-9;  // positions are moved by ulps of the northing: 9e-10
  EXPECT_LE(here.at_least_m, there.at_most_m + rounded_m);
  EXPECT_LE(there.at_least_m, here.at_most_m + rounded_m);
  EXPECT_NEAR(away.mean(0.05).mean.value_m, mean.mean.value_m, rounded_m);
  EXPECT_NEAR(away.mean(0.05).rms.value_m, mean.rms.value_m, rounded_m);
}

TEST(MeshDistance, IsTheSameForAnyNumberOfThreads) {
  Random random(13);
  const TriangleMesh from = soup(300, random), to = soup(300, random);
  std::vector<LargestDistance> largest;
  std::vector<MeanDistance> means;
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 5);
    tbb::task_arena(threads).execute([&] {
      const MeshDistance distance(from, to);
      largest.push_back(distance.largest(1e-7));
      means.push_back(distance.mean(0.02, {0.1, 20}));
    });
  }
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_EQ(largest[i].at_least_m, largest[0].at_least_m);
    EXPECT_EQ(largest[i].at_most_m, largest[0].at_most_m);
    EXPECT_EQ(largest[i].from, largest[0].from);
    EXPECT_EQ(largest[i].to, largest[0].to);
    EXPECT_EQ(largest[i].pieces, largest[0].pieces);
    for (const auto length : {&MeanDistance::mean, &MeanDistance::rms}) {
      EXPECT_EQ((means[i].*length).value_m, (means[0].*length).value_m);
      EXPECT_EQ((means[i].*length).at_least_m, (means[0].*length).at_least_m);
      EXPECT_EQ((means[i].*length).at_most_m, (means[0].*length).at_most_m);
    }
    EXPECT_EQ(means[i].turn.mean_rad(), means[0].turn.mean_rad());
    EXPECT_EQ(means[i].bins_m2, means[0].bins_m2);
    EXPECT_EQ(means[i].largest_m, means[0].largest_m);
  }
}

TEST(MeshDistance, BoundsHoldWhenTheSearchIsCutShort) {
  const TriangleMesh flat = plane({-1, -1, 0}, {2, 2}, {1, 1}), bump = bumpy(0.3);
  double last_m = 10;
  for (const std::size_t most_pieces : {1u, 20u, 200u}) {
    const LargestDistance found = MeshDistance(flat, bump).largest(1e-12, most_pieces);
    const double truth_m = 0.15 / std::hypot(0.3, 0.5);
    EXPECT_LE(found.at_least_m, truth_m);
    EXPECT_GE(found.at_most_m, truth_m);
    EXPECT_LE(found.at_most_m - found.at_least_m, last_m);
    last_m = found.at_most_m - found.at_least_m;
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

TEST(MeshDistance, ReportsInvalidInput) {
  const TriangleMesh good = plane({0, 0, 0}, {1, 1}, {1, 1});
  TriangleMesh bad = good;
  bad.vertices_m[2].y = std::numeric_limits<double>::quiet_NaN();
  bad.triangles[1].z = 4;
  const auto both = AllOf(HasSubstr("vertex 2 must have a finite position"),
                          HasSubstr("triangle 1 refers to a vertex beyond the last of 4"));
  EXPECT_THAT(message_of([&] { MeshDistance(bad, good); }), AllOf(HasSubstr("mesh `from`"), both));
  EXPECT_THAT(message_of([&] { MeshDistance(good, bad); }), AllOf(HasSubstr("mesh `to`"), both));
  EXPECT_THAT(message_of([&] { MeshDistance({}, good); }),
              HasSubstr("mesh `from`: there is no triangle"));
  EXPECT_THAT(message_of([&] { MeshDistance(good, {}); }),
              HasSubstr("mesh `to`: there is no triangle"));
  const MeshDistance distance(good, good);
  for (const double tolerance_m : {0.0, -1.0, 1e-20, std::nan("")})
    EXPECT_THAT(message_of([&] { static_cast<void>(distance.largest(tolerance_m)); }),
                HasSubstr("must exceed"));
  for (const double step_m : {0.0, -1.0, std::nan("")})
    EXPECT_THAT(message_of([&] { static_cast<void>(distance.mean(step_m)); }),
                HasSubstr("step_m = "));
  EXPECT_THAT(message_of([&] { static_cast<void>(distance.mean(1e-6)); }),
              HasSubstr("use a larger step"));
  const TriangleMesh needle{{{0, 0, 0}, {1, 0, 0}}, {{0, 1, 1}}};
  EXPECT_THAT(message_of([&] { static_cast<void>(MeshDistance(needle, good).mean(1)); }),
              HasSubstr("no mean over its area"));
}

}  // namespace
}  // namespace groundray::accuracy_test
