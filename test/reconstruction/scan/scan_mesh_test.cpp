#include "reconstruction/scan/scan_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "test/support/beam_fan.h"

namespace groundray {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)
using Random = std::mt19937_64;

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

ScreeningLimits limits(double incidence_deg, double longest_m = infinite, double noise_sds = 0) {
  return {.incidence_rad = incidence_deg * degree, .longest_m = longest_m, .noise_sds = noise_sds};
}

OrganisedScan scan_of(const BeamFan& fan, const RangeOf& range_m) {
  return organise(seen(fan, range_m), ReturnChoice::Last, RowOrder::Number).scan;
}

// Triangles by their cells, each beginning with the least.
std::set<std::array<std::uint32_t, 3>> faces_of(const ScanMesh& made) {
  std::set<std::array<std::uint32_t, 3>> faces;
  for (const glm::uvec3& t : made.mesh.shape.triangles) {
    std::array<std::uint32_t, 3> face{made.cells[t.x], made.cells[t.y], made.cells[t.z]};
    std::ranges::rotate(face, std::ranges::min_element(face));
    faces.insert(face);
  }
  return faces;
}

std::size_t all_faces(const ScanMesh& made) {
  return made.mesh.shape.triangles.size() + made.occlusion.shape.triangles.size();
}

// Angle between a beam and the normal of the plane through its end that holds the edge and is seen
// most squarely: from the edge's angle with the beam alone.
double edge_incidence_rad(const glm::dvec3& far, const glm::dvec3& near) {
  const double cosine = glm::dot(glm::normalize(far), glm::normalize(far - near));
  return std::asin(std::min(1.0, std::abs(cosine)));
}

// What must hold of any mesh that link makes, whatever it was made of.
void expect_sound(const ScanMesh& made, const OrganisedScan& scan) {
  const TriangleMesh& mesh = made.mesh.shape;
  ASSERT_EQ(made.cells.size(), mesh.vertices_m.size());
  ASSERT_EQ(made.origins_m.size(), mesh.vertices_m.size());
  ASSERT_EQ(made.mesh.confidence.size(), mesh.vertices_m.size());
  ASSERT_EQ(made.face_confidence.size(), mesh.triangles.size());
  ASSERT_TRUE(std::ranges::is_sorted(made.cells));
  for (std::size_t i = 0; i < made.cells.size(); ++i) {
    ASSERT_EQ(mesh.vertices_m[i], scan.points_m[made.cells[i]]);
    ASSERT_EQ(made.origins_m[i], scan.origins_m[made.cells[i]]);
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const glm::uvec3& t : mesh.triangles) {
    const auto &a = mesh.vertices_m[t.x], &b = mesh.vertices_m[t.y], &c = mesh.vertices_m[t.z];
    ASSERT_GT(glm::dot(glm::cross(b - a, c - a), made.origins_m[t.x] - a), 0) << "turned away";
    ASSERT_TRUE(edges.emplace(t.x, t.y).second) << "an edge twice in one direction";
    ASSERT_TRUE(edges.emplace(t.y, t.z).second);
    ASSERT_TRUE(edges.emplace(t.z, t.x).second);
  }
  for (const float c : made.face_confidence) ASSERT_TRUE(0 <= c && c <= 1) << c;
  for (const float c : made.mesh.confidence) ASSERT_TRUE(0 <= c && c <= 1) << c;
  ASSERT_EQ(made.occlusion.origins_m.size(), made.occlusion.shape.vertices_m.size());
}

// By the law of sines an edge along which two beams dθ apart meet a plane is r sin dθ / cos i, r
// the nearer range and i the incidence in the beams' plane at the farther end. So along a wall that
// runs from square to edge-on, faces end where the farther end's incidence is the limit.
TEST(ScanMesh, WedgesAreLinkedUpToTheLimit) {
  const double step_rad = 0.02 * degree;
  const BeamFan fan{.rings = 3,
                    .lowest_rad = -0.002 * degree,
                    .highest_rad = 0.002 * degree,
                    .columns = 1000,
                    .columns_per_turn = 18000,
                    .first_azimuth_rad = 70 * degree};
  const OrganisedScan scan = scan_of(fan, plane_at({1, 0, 0}, 2));
  for (const double limit_deg : {75.5, 85., 88., 89.}) {
    const ScanMesh made = link(scan, limits(limit_deg));
    expect_sound(made, scan);
    double farthest_deg = 0;
    for (const glm::dvec3& p : made.mesh.shape.vertices_m)
      farthest_deg = std::max(farthest_deg, std::atan2(p.y, p.x) / degree);
    // The last column within the limit; rings 0.002 degrees aside change nothing of it.
    EXPECT_LE(farthest_deg, limit_deg + 1e-5) << limit_deg;
    EXPECT_GT(farthest_deg, limit_deg - step_rad / degree - 1e-5) << limit_deg;
    EXPECT_EQ(all_faces(made), 2u * 2 * 999);
    EXPECT_EQ(made.mesh.shape.triangles.size(),
              4 * static_cast<std::size_t>(std::lround((farthest_deg - 70) / 0.02)));
  }
}

// Planes turned any way: each triangle is accepted exactly where the incidence in the plane of
// each two beams, and of the plane itself, is within the limit.
TEST(ScanMesh, PlanesAreLinkedWhereTheirIncidenceAllows) {
  Random random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::size_t accepted = 0, rejected = 0, by_plane_alone = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const BeamFan fan{.rings = 12,
                      .lowest_rad = -0.06,
                      .highest_rad = 0.06,
                      .columns = 16,
                      .columns_per_turn = 2 * std::numbers::pi / (trial % 2 == 0 ? 0.01 : 0.004),
                      .first_azimuth_rad = -0.08};
    const double tilt = (80 + 8 * uniform(random)) * degree;
    const double about = std::numbers::pi * uniform(random);
    const glm::dvec3 normal(std::cos(tilt), std::sin(tilt) * std::cos(about),
                            std::sin(tilt) * std::sin(about));
    const OrganisedScan scan = scan_of(fan, plane_at(normal, 3));
    const double limit = 80 * degree, slack = 1e-4;  // 1 - cos(dθ / 2) in cosine, and centroids
    const ScanMesh made = link(scan, limits(80));
    expect_sound(made, scan);
    const auto judge = [&](const std::array<glm::dvec3, 3>& p) {
      double edges = 0;
      for (std::size_t j = 0; j < 3; ++j) {
        glm::dvec3 a = p[j], b = p[(j + 1) % 3];
        if (glm::length(a) < glm::length(b)) std::swap(a, b);
        edges = std::max(edges, edge_incidence_rad(a, b));
      }
      const glm::dvec3 amid =
          glm::normalize(glm::normalize(p[0]) + glm::normalize(p[1]) + glm::normalize(p[2]));
      const double plane = std::acos(std::abs(glm::dot(amid, normal)));
      by_plane_alone += plane > limit + slack && edges < limit - slack;
      return std::max(edges, plane);
    };
    const auto corners = [](const TriangleMesh& mesh, const glm::uvec3& t) {
      return std::array{mesh.vertices_m[t.x], mesh.vertices_m[t.y], mesh.vertices_m[t.z]};
    };
    for (const glm::uvec3& t : made.mesh.shape.triangles)
      EXPECT_LE(judge(corners(made.mesh.shape, t)), limit + slack);
    for (const glm::uvec3& t : made.occlusion.shape.triangles)
      EXPECT_GE(judge(corners(made.occlusion.shape, t)), limit - slack);
    accepted += made.mesh.shape.triangles.size();
    rejected += made.occlusion.shape.triangles.size();
  }
  EXPECT_GT(accepted, 1000u);
  EXPECT_GT(rejected, 1000u);
  EXPECT_GT(by_plane_alone, 100u) << "the rule for triangles must matter";
}

TEST(ScanMesh, EdgesHaveALargestLength) {
  const BeamFan fan{.rings = 8, .lowest_rad = -20 * degree, .highest_rad = -2 * degree};
  const OrganisedScan scan = scan_of(fan, plane_at({0, 0, -1}, 1.5));
  for (const double longest_m : {0.5, 2., 5., 20.}) {
    const ScanMesh made = link(scan, limits(89.9, longest_m));
    expect_sound(made, scan);
    std::size_t rings = 0;  // pairs of rings that are near enough, diagonals and all
    for (int ring = 0; ring + 1 < fan.rings; ++ring) {
      const auto p = [&](int r, int c) {
        return scan.points_m[static_cast<std::size_t>(r) * 360 + static_cast<std::size_t>(c)];
      };
      const double diagonal_m = std::min(glm::distance(p(ring, 0), p(ring + 1, 1)),
                                         glm::distance(p(ring, 1), p(ring + 1, 0)));
      rings += diagonal_m <= longest_m;
    }
    EXPECT_EQ(made.mesh.shape.triangles.size(), rings * 2 * 360) << longest_m;
  }
}

TEST(ScanMesh, StepsAreNotBridged) {
  const BeamFan fan{
      .rings = 10, .columns = 60, .columns_per_turn = 720, .first_azimuth_rad = -15 * degree};
  const RangeOf near = plane_at({1, 0, 0}, 5), far = plane_at({1, 0, 0}, 8);
  const OrganisedScan scan = scan_of(
      fan, [&](const glm::dvec3& towards) { return towards.y < 0 ? near(towards) : far(towards); });
  for (const auto& preset :
       {ScreeningLimits::ground(), ScreeningLimits::strict(), ScreeningLimits::object()}) {
    const ScanMesh made = link(scan, preset);
    expect_sound(made, scan);
    EXPECT_EQ(all_faces(made), 9u * 59 * 2);
    EXPECT_EQ(made.occlusion.shape.triangles.size(), 9u * 2) << "one column of quads";
    for (const glm::uvec3& t : made.mesh.shape.triangles) {
      const auto x = [&](std::uint32_t v) { return made.mesh.shape.vertices_m[v].x; };
      EXPECT_NEAR(x(t.x), x(t.y), 1e-9);
      EXPECT_NEAR(x(t.x), x(t.z), 1e-9);
    }
    for (const glm::uvec3& t : made.occlusion.shape.triangles) {
      std::set<long> walls;
      for (const std::uint32_t v : {t.x, t.y, t.z})
        walls.insert(std::lround(made.occlusion.shape.vertices_m[v].x));
      EXPECT_EQ(walls, (std::set<long>{5, 8}));
    }
  }
}

// A trunk that three columns meet, before a wall: two strips of it, and a rim of occlusion.
TEST(ScanMesh, ThinTrunksAreKept) {
  const BeamFan fan{
      .rings = 20, .columns = 41, .columns_per_turn = 1800, .first_azimuth_rad = -4 * degree};
  const double radius_m = 0.042;  // at 8 m: 0.3 degrees to each side, one step of 0.2 and no two
  const RangeOf trunk = [=](const glm::dvec3& towards) {
    const double flat = std::hypot(towards.x, towards.y), x = towards.x / flat;
    const double root = x * x * 64 - (64 - radius_m * radius_m);
    return root < 0 || x < 0 ? infinite : (8 * x - std::sqrt(root)) / flat;
  };
  const OrganisedScan scan = scan_of(fan, nearer(trunk, plane_at({1, 0, 0}, 14)));
  std::set<std::uint32_t> on_trunk;
  for (std::uint32_t i = 0; i < scan.points_m.size(); ++i) {
    if (std::hypot(scan.points_m[i].x, scan.points_m[i].y) < 9) on_trunk.insert(i);
  }
  ASSERT_EQ(on_trunk.size(), 3u * 20);
  const ScanMesh made = link(scan, ScreeningLimits::ground());
  expect_sound(made, scan);
  std::size_t trunk_faces = 0;
  for (const auto& face : faces_of(made)) {
    const auto on = std::ranges::count_if(face, [&](auto cell) { return on_trunk.contains(cell); });
    EXPECT_TRUE(on == 0 || on == 3);
    trunk_faces += on == 3;
  }
  EXPECT_EQ(trunk_faces, 19u * 2 * 2);
  EXPECT_EQ(made.occlusion.shape.triangles.size(), 19u * 2 * 2);
}

TEST(ScanMesh, RoundScansAreClosed) {
  const RangeOf cylinder = [](const glm::dvec3& towards) {
    return 6 / std::hypot(towards.x, towards.y);
  };
  const BeamFan fan{.rings = 5, .columns = 90, .columns_per_turn = 90};
  const ScreeningLimits any = limits(85);
  ScanReturns fired = seen(fan, cylinder);
  EXPECT_EQ(link(organise(fired).scan, any).mesh.shape.triangles.size(), 4u * 90 * 2);
  fired.columns.clear();
  EXPECT_EQ(link(organise(fired).scan, any).mesh.shape.triangles.size(), 4u * 90 * 2);
  // Without columns 30 and 31: the seam of azimuths is linked, the gap is not.
  const ScanReturns gap = kept(fired, [](std::size_t i) { return i % 90 != 30 && i % 90 != 31; });
  const OrganisedScan open = organise(gap).scan;
  const ScanMesh made = link(open, any);
  expect_sound(made, open);
  EXPECT_EQ(all_faces(made), 4u * 87 * 2);
  EXPECT_EQ(made.mesh.shape.triangles.size(), 4u * 87 * 2);
}

TEST(ScanMesh, NoPartOfTheGridIsLost) {
  Random random(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 100; ++trial) {
    const int rings = 2 + trial % 5, columns = 3 + trial % 11;
    const bool is_round = trial % 3 == 0;
    const BeamFan fan{
        .rings = rings, .columns = columns, .columns_per_turn = is_round ? columns : 360.};
    OrganisedScan scan = scan_of(fan, [&](const glm::dvec3&) { return 1 + 10 * uniform(random); });
    scan.is_round = is_round;
    for (glm::dvec3& p : scan.points_m) {
      if (uniform(random) < 0.3) p = glm::dvec3(nan);
    }
    std::size_t expected = 0;
    for (int row = 0; row + 1 < rings; ++row) {
      for (int column = 0; column + (is_round ? 0 : 1) < columns; ++column) {
        int there = 0;
        for (const auto& [r, c] : {std::pair(0, 0), {0, 1}, {1, 0}, {1, 1}}) {
          const int cell = (row + r) * columns + (column + c) % columns;
          there += std::isfinite(scan.points_m[static_cast<std::size_t>(cell)].x);
        }
        expected += static_cast<std::size_t>(std::max(0, there - 2));
      }
    }
    const ScanMesh made = link(scan, limits(60 + uniform(random) * 29));
    expect_sound(made, scan);
    EXPECT_EQ(all_faces(made), expected);
  }
}

// The same surface, whichever way rows and columns run.
TEST(ScanMesh, OrderOfRowsAndColumnsDoesNotMatter) {
  Random random(3);
  std::normal_distribution<double> normal;
  const BeamFan fan{.rings = 12, .columns = 120, .columns_per_turn = 120};
  const ScanReturns fired = seen(fan, [&](const glm::dvec3& towards) {
    return 6 + std::sin(7 * towards.x) + 0.1 * normal(random);
  });
  const auto surface = [](const OrganisedScan& scan) {
    const ScanMesh made = link(scan, limits(75));
    expect_sound(made, scan);
    std::map<std::array<std::uint32_t, 3>, float> faces;
    for (std::size_t f = 0; f < made.mesh.shape.triangles.size(); ++f) {
      const glm::uvec3& t = made.mesh.shape.triangles[f];
      std::array<std::uint32_t, 3> face{scan.returns[made.cells[t.x]],
                                        scan.returns[made.cells[t.y]],
                                        scan.returns[made.cells[t.z]]};
      std::ranges::rotate(face, std::ranges::min_element(face));
      faces[face] = made.face_confidence[f];
    }
    return faces;
  };
  const auto expected = surface(organise(fired).scan);
  EXPECT_GT(expected.size(), 1000u);
  ScanReturns permuted = fired, mirrored = fired;
  for (std::int32_t& ring : permuted.rings) ring = (ring * 5 + 3) % 12;
  for (std::int32_t& column : mirrored.columns) column = 119 - column;
  for (std::int32_t& ring : mirrored.rings) ring = 11 - ring;
  for (const OrganisedScan& scan :
       {organise(permuted).scan, organise(mirrored).scan,
        organise(mirrored, ReturnChoice::Last, RowOrder::Number).scan}) {
    const auto found = surface(scan);
    ASSERT_EQ(found.size(), expected.size());
    for (const auto& [face, confidence] : expected) {
      ASSERT_TRUE(found.contains(face));
      EXPECT_NEAR(found.at(face), confidence, 1e-6);
    }
  }
}

// Parallel beams, as of a range grid: how far they are apart is how far their origins are.
TEST(ScanMesh, ParallelBeamsAreJudgedByTheirSpacing) {
  for (const double incidence_deg : {0., 40., 75., 76., 84.9, 85.1}) {
    OrganisedScan scan{.rows = 6, .columns = 9};
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column < 9; ++column) {
        const double x = 0.001 * column;
        scan.origins_m.emplace_back(x, 0.001 * row, 1);
        scan.points_m.emplace_back(x, 0.001 * row, x * std::tan(incidence_deg * degree));
        scan.sd_m.push_back(0);
      }
    }
    EXPECT_EQ(link(scan, limits(85)).mesh.shape.triangles.size(), incidence_deg < 85 ? 80u : 0u);
    const ScanMesh as_object = link(scan, ScreeningLimits::object());
    EXPECT_EQ(as_object.mesh.shape.triangles.size(), incidence_deg < 75.52 ? 80u : 0u);
    expect_sound(as_object, scan);
  }
}

// A sensor that drives while it scans sees the ground as one that stands: what counts is how far
// beams are apart where they end.
TEST(ScanMesh, MovingSensorsAreJudgedAlike) {
  const BeamFan fan{.rings = 32,
                    .lowest_rad = -25 * degree,
                    .highest_rad = -2.5 * degree,
                    .columns = 600,
                    .columns_per_turn = 600};
  const OrganisedScan standing = scan_of(fan, plane_at({0, 0, -1}, 1.9));
  for (const glm::dvec3& velocity : {glm::dvec3(10, 0, 0), glm::dvec3(0, 25, 0)}) {
    OrganisedScan driving = standing;
    for (std::size_t i = 0; i < driving.points_m.size(); ++i) {
      const glm::dvec3 way_m = velocity * (static_cast<double>(i % 600) / 6000);
      driving.points_m[i] += way_m;
      driving.origins_m[i] += way_m;
    }
    driving.is_round = false;
    const ScanMesh made = link(driving, limits(88));
    expect_sound(made, driving);
    EXPECT_EQ(made.occlusion.shape.triangles.size(), 0u);
    EXPECT_EQ(made.mesh.shape.triangles.size(), 31u * 599 * 2);
  }
}

// Confidence of a wall seen squarely by parallel beams is known: 1 well inside, 1/4 at the border.
TEST(ScanMesh, ConfidenceFallsTowardsTheBorder) {
  OrganisedScan scan{.rows = 12, .columns = 12};
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 12; ++column) {
      scan.origins_m.emplace_back(0.01 * column, 0.01 * row, 1);
      scan.points_m.emplace_back(0.01 * column, 0.01 * row, 0);
      scan.sd_m.push_back(0);
    }
  }
  const ScanMesh made = link(scan, ScreeningLimits::object());
  ASSERT_EQ(made.cells.size(), 144u);
  for (std::size_t i = 0; i < 144; ++i) {
    const int row = static_cast<int>(i) / 12, column = static_cast<int>(i) % 12;
    const int depth = std::min({row, column, 11 - row, 11 - column, 3});
    EXPECT_NEAR(made.mesh.confidence[i], (1 + depth) / 4., 1e-6) << i;
  }
}

// Of a plane seen under an angle each face has the cosine; of stretched cells less.
TEST(ScanMesh, ConfidenceIsTheCosineOfIncidenceAndLessWhereStretched) {
  for (const double stretch : {1., 3., 10.}) {
    for (const double incidence_deg : {0., 30., 60.}) {
      const double slope = std::tan(incidence_deg * degree);
      OrganisedScan scan{.rows = 20, .columns = 20};
      for (int row = 0; row < 20; ++row) {
        for (int column = 0; column < 20; ++column) {
          const double x = 0.01 * column, y = 0.01 * stretch * row;
          scan.origins_m.emplace_back(x, y, 5);
          scan.points_m.emplace_back(x, y, slope * y);
          scan.sd_m.push_back(0);
        }
      }
      const ScanMesh made = link(scan, limits(89));
      const double high_m = 0.01 * stretch / std::cos(incidence_deg * degree);
      const double longest_m2 = high_m * high_m + 1e-4;
      const double expected =
          std::cos(incidence_deg * degree) * std::min(1.0, 2 * 0.01 * high_m / longest_m2);
      const auto amid = static_cast<std::size_t>(std::ranges::find(made.cells, 10u * 20 + 10) -
                                                 made.cells.begin());
      EXPECT_NEAR(made.mesh.confidence[amid], expected, 1e-6);
      EXPECT_NEAR(std::ranges::max(made.face_confidence), expected, 1e-6);
    }
  }
}

TEST(ScanMesh, WhatIsKnownOfReturnsReachesVertices) {
  OrganisedScan scan = scan_of({.rings = 4, .columns = 30}, plane_at({1, 0, 0}, 5));
  for (std::size_t i = 0; i < scan.points_m.size(); ++i) {
    scan.sd_m[i] = 0.001f * static_cast<float>(i);
    scan.labels.push_back(static_cast<std::uint16_t>(i % 13));
  }
  const ScanMesh made = link(scan, ScreeningLimits::ground());
  ASSERT_FALSE(made.cells.empty());
  for (std::size_t i = 0; i < made.cells.size(); ++i) {
    EXPECT_EQ(made.mesh.sd_m[i], scan.sd_m[made.cells[i]]);
    EXPECT_EQ(made.mesh.labels[i], scan.labels[made.cells[i]]);
  }
}

// Noise tilts short edges as a slope would. Of a smooth wall or ground seen with it hardly a face
// may be lost: at three standard deviations 0.0027 of single differences are, and a face has three
// and its own slope.
TEST(ScanMesh, NoiseAloneTearsNoHoles) {
  Random random(4);
  std::normal_distribution<double> normal(0, 0.02);
  const BeamFan wall{.rings = 100,
                     .lowest_rad = -2.5 * degree,
                     .highest_rad = 2.5 * degree,
                     .columns = 100,
                     .columns_per_turn = 7200,
                     .first_azimuth_rad = -2.5 * degree};
  const BeamFan ground{.rings = 48,
                       .lowest_rad = -25 * degree,
                       .highest_rad = -8 * degree,
                       .columns = 300,
                       .columns_per_turn = 3600};
  const std::vector<std::pair<BeamFan, RangeOf>> scenes{
      {wall, plane_at({1, 0, 0}, 10)},
      {wall, plane_at({1, 0, 0}, 3)},
      {wall, plane_at(glm::normalize(glm::dvec3(1, 1.5, 0)), 5)},
      {ground, plane_at({0, 0, -1}, 0.5)}};
  for (const auto& scene : scenes) {
    ScanReturns fired = seen(scene.first, scene.second);
    for (glm::dvec3& p : fired.p_S) p += normal(random) * glm::normalize(p);
    fired.sd_m.assign(fired.p_S.size(), 0.02f);
    const OrganisedScan scan = organise(fired).scan;
    for (ScreeningLimits preset : {ScreeningLimits::ground(), ScreeningLimits::strict()}) {
      const ScanMesh made = link(scan, preset);
      expect_sound(made, scan);
      EXPECT_LE(made.occlusion.shape.triangles.size(), all_faces(made) / 1000);
    }
    ScreeningLimits blind = ScreeningLimits::object();  // for which noise is a fault of the scene
    blind.noise_sds = 0;
    const ScanMesh torn = link(scan, blind);
    EXPECT_GE(torn.occlusion.shape.triangles.size(), all_faces(torn) / 4);
  }
}

TEST(ScanMesh, GridsWithoutNeighboursMakeNoFaces) {
  const ScreeningLimits any = ScreeningLimits::ground();
  EXPECT_EQ(all_faces(link({}, any)), 0u);
  for (const auto& [rings, columns] : {std::pair(1, 50), {50, 1}, {1, 1}, {2, 2}}) {
    OrganisedScan scan = scan_of({.rings = rings, .columns = columns}, plane_at({1, 0, 0}, 5));
    for (const bool is_round : {false, true}) {
      scan.is_round = is_round;
      const ScanMesh made = link(scan, any);
      expect_sound(made, scan);
      EXPECT_EQ(all_faces(made), rings == 2 ? 2u : 0u);
    }
  }
  for (const auto& [rows, columns] : {std::pair(5, 0), {0, 5}}) {
    const OrganisedScan nothing{.rows = rows, .columns = columns, .is_round = true};
    EXPECT_EQ(all_faces(link(nothing, any)), 0u);
  }
  const OrganisedScan sky = organise(ScanReturns{.p_S = {glm::dvec3(nan)}}).scan;
  EXPECT_EQ(all_faces(link(sky, any)), 0u);
}

// Beams that cross, points on top of each other, at their origins, or as far as can be.
TEST(ScanMesh, BadGeometryMakesNoBadFaces) {
  Random random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    OrganisedScan scan{.rows = 5, .columns = 6, .is_round = trial % 2 == 0};
    for (std::size_t i = 0; i < 30; ++i) {
      const double scale = std::pow(10., static_cast<double>(trial % 5) * 3 - 3);
      const auto any = [&] {
        return scale * glm::dvec3(uniform(random), uniform(random), uniform(random));
      };
      scan.points_m.push_back(uniform(random) < -0.7 ? glm::dvec3(1) : any());
      scan.origins_m.push_back(uniform(random) < -0.9   ? scan.points_m.back()
                               : uniform(random) < -0.3 ? glm::dvec3(0)
                                                        : any());
      scan.sd_m.push_back(trial % 3 == 0 ? 0.f : static_cast<float>(std::abs(uniform(random))));
    }
    const ScanMesh made = link(scan, limits(85, infinite, 3));
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const glm::uvec3& t : made.mesh.shape.triangles) {
      EXPECT_TRUE(edges.emplace(t.x, t.y).second);
      EXPECT_TRUE(edges.emplace(t.y, t.z).second);
      EXPECT_TRUE(edges.emplace(t.z, t.x).second);
    }
    for (const float c : made.face_confidence) EXPECT_TRUE(0 <= c && c <= 1) << c;
    for (const float c : made.mesh.confidence) EXPECT_TRUE(0 <= c && c <= 1) << c;
  }
}

TEST(ScanMesh, FaultsAreNamedAllAtOnce) {
  const OrganisedScan scan = scan_of({.rings = 3, .columns = 3}, plane_at({1, 0, 0}, 5));
  const auto message = [](const OrganisedScan& from, const ScreeningLimits& by) -> std::string {
    try {
      link(from, by);
    } catch (const Error& fault) {
      return fault.what();
    }
    return "";
  };
  EXPECT_THAT(message(scan, {.incidence_rad = 88, .longest_m = 0, .noise_sds = -1}),
              AllOf(HasSubstr("incidence_rad = 88 must be > 0 and <= pi / 2: is it in degrees?"),
                    HasSubstr("longest_m = 0 must be > 0"), HasSubstr("noise_sds = -1")));
  EXPECT_THAT(message(scan, {.incidence_rad = nan, .longest_m = nan, .noise_sds = nan}),
              AllOf(HasSubstr("incidence_rad"), HasSubstr("longest_m"), HasSubstr("noise_sds")));
  OrganisedScan bad = scan;
  bad.points_m.pop_back();
  bad.sd_m[0] = -1;
  bad.labels.resize(2);
  EXPECT_THAT(message(bad, ScreeningLimits::ground()),
              AllOf(HasSubstr("points_m has 8 values for 9 cells"), HasSubstr("sd_m of cell 0"),
                    HasSubstr("labels has 2 values")));
  bad = scan;
  bad.points_m[4] = {1e16, 0, 0};
  EXPECT_THAT(message(bad, ScreeningLimits::ground()), HasSubstr("the point of cell 4"));
  EXPECT_EQ(message(scan, {.incidence_rad = std::numbers::pi / 2, .longest_m = infinite}), "");
}

}  // namespace
}  // namespace groundray
