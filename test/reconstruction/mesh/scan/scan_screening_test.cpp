#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "reconstruction/mesh/scan/scan_mesh.h"
#include "test/support/scans/beam_fan.h"
#include "test/support/scans/linked_scan.h"

namespace groundray::scan_screening_test {
namespace {

using namespace groundray::testing;  // NOLINT(google-build-using-namespace)
using Random = std::mt19937_64;

constexpr double infinite = std::numeric_limits<double>::infinity();

// Smallest incidence angle over all planes that contain the edge: it follows from the edge's angle
// with the beam alone.
double edge_incidence_rad(const glm::dvec3& far, const glm::dvec3& near) {
  const double cosine = glm::dot(glm::normalize(far), glm::normalize(far - near));
  return std::asin(std::min(1.0, std::abs(cosine)));
}

// Limits that were measured and published for each use.
TEST(ScanScreening, PresetsHaveTheirDocumentedLimits) {
  const ScreeningLimits ground = ScreeningLimits::ground(), strict = ScreeningLimits::strict(),
                        object = ScreeningLimits::object();
  EXPECT_DOUBLE_EQ(ground.incidence_rad, 88 * degree);
  EXPECT_EQ(ground.longest_m, 3);
  EXPECT_DOUBLE_EQ(strict.incidence_rad, 85 * degree);
  EXPECT_EQ(strict.longest_m, 2);
  EXPECT_NEAR(object.incidence_rad, 75.5 * degree, 0.05 * degree);
  EXPECT_DOUBLE_EQ(1 / std::cos(object.incidence_rad), 4) << "times the spacing of beams";
  EXPECT_EQ(object.longest_m, infinite);
  for (const ScreeningLimits& limits : {ground, strict, object}) EXPECT_EQ(limits.noise_sds, 3);
}

// By the law of sines an edge along which two beams dθ apart hit a plane is r sin dθ / cos i long,
// with r the nearer range and i the incidence in the beams' plane at the farther end. So along a
// wall that runs from square to edge-on, faces end where the farther end's incidence reaches the
// limit.
TEST(ScanScreening, WedgesAreLinkedUpToTheLimit) {
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
    // The last column within the limit; rings 0.002 degrees apart do not change it.
    EXPECT_LE(farthest_deg, limit_deg + 1e-5) << limit_deg;
    EXPECT_GT(farthest_deg, limit_deg - step_rad / degree - 1e-5) << limit_deg;
    EXPECT_EQ(all_faces(made), 2u * 2 * 999);
    EXPECT_EQ(made.mesh.shape.triangles.size(),
              4 * static_cast<std::size_t>(std::lround((farthest_deg - 70) / 0.02)));
  }
}

// Arbitrarily oriented planes: each triangle is accepted exactly where the incidence in the plane
// of each pair of beams, and that of the plane itself, is within the limit.
TEST(ScanScreening, PlanesAreLinkedUpToTheIncidenceLimit) {
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

TEST(ScanScreening, EdgesAreLimitedInLength) {
  const BeamFan fan{.rings = 8, .lowest_rad = -20 * degree, .highest_rad = -2 * degree};
  const OrganisedScan scan = scan_of(fan, plane_at({0, 0, -1}, 1.5));
  for (const double longest_m : {0.5, 2., 5., 20.}) {
    const ScanMesh made = link(scan, limits(89.9, longest_m));
    expect_sound(made, scan);
    std::size_t rings = 0;  // pairs of rings that are near enough, including diagonals
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

TEST(ScanScreening, StepsAreNotBridged) {
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

// A trunk that three columns hit, in front of a wall: two strips of it, surrounded by occlusion.
TEST(ScanScreening, ThinTrunksAreKept) {
  const BeamFan fan{
      .rings = 20, .columns = 41, .columns_per_turn = 1800, .first_azimuth_rad = -4 * degree};
  // At 8 m: 0.3 degrees to each side, between one and two steps of 0.2.
  const double radius_m = 0.042;
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

// Parallel beams, as in a range grid: their spacing is that of their origins.
TEST(ScanScreening, ParallelBeamsAreJudgedByTheirSpacing) {
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

// A sensor that moves while it scans sees the ground as a stationary one does: the relevant spacing
// of beams is that at their ends.
TEST(ScanScreening, MovingSensorsAreJudgedLikeStationaryOnes) {
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

// Noise tilts short edges as a slope would. Hardly any face of a smooth wall or ground may be lost
// to it: 0.0027 of single differences exceed three standard deviations, and a face has three edges
// and its own slope.
TEST(ScanScreening, NoiseAloneTearsNoHoles) {
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
    ScreeningLimits blind = ScreeningLimits::object();  // treats noise as a property of the scene
    blind.noise_sds = 0;
    const ScanMesh torn = link(scan, blind);
    EXPECT_GE(torn.occlusion.shape.triangles.size(), all_faces(torn) / 4);
  }
}

}  // namespace
}  // namespace groundray::scan_screening_test
