#include "reconstruction/mesh/simplify/lindstrom_turk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/geometry/height_grid.h"
#include "reconstruction/mesh/accuracy/accuracy.h"
#include "reconstruction/mesh/mesh_arrays.h"
#include "test/support/margin.h"
#include "test/support/scans/solid.h"
#include "test/support/terrain/sample_terrain.h"
#include "test/support/terrain/surface_check.h"

namespace groundray::lindstrom_turk_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

HeightGrid hills(int samples) {
  std::vector<float> heights_m;
  for (int row = 0; row < samples; ++row) {
    for (int column = 0; column < samples; ++column)
      heights_m.push_back(static_cast<float>(3 * std::sin(0.3 * column) * std::cos(0.2 * row)));
  }
  return {{samples, samples}, {0, 0}, {1, 1}, heights_m};
}

HeightGrid plane(int samples) {
  std::vector<float> heights_m(static_cast<std::size_t>(samples * samples), 2.f);
  return {{samples, samples}, {0, 0}, {1, 1}, std::move(heights_m)};
}

void expect_accounted(const ReducedMesh& reduced, const TriangleMesh& original) {
  const std::vector<glm::dvec3>& to_m = reduced.mesh.vertices_m;
  ASSERT_EQ(reduced.sources.size(), to_m.size());
  ASSERT_EQ(reduced.became.size(), original.vertices_m.size());
  std::vector<double> nearest_m(to_m.size(), std::numeric_limits<double>::infinity());
  std::vector<int> count(to_m.size(), 0);
  for (std::size_t i = 0; i < reduced.became.size(); ++i) {
    const std::uint32_t to = reduced.became[i];
    ASSERT_LT(to, to_m.size());
    ++count[to];
    nearest_m[to] = std::min(nearest_m[to], glm::distance(original.vertices_m[i], to_m[to]));
  }
  for (std::size_t i = 0; i < to_m.size(); ++i) {
    EXPECT_EQ(reduced.became[reduced.sources[i]], i);
    EXPECT_EQ(glm::distance(original.vertices_m[reduced.sources[i]], to_m[i]), nearest_m[i]);
    if (count[i] == 1) {
      EXPECT_EQ(to_m[i], original.vertices_m[reduced.sources[i]]);
    }
  }
}

TEST(LindstromTurk, ReducesToTheRequestedTrianglesOrOneLess) {
  const TriangleMesh ball = testing::icosphere(3, 4).mesh, hill = testing::mesh_of(hills(41));
  for (const TriangleMesh& mesh : {ball, hill}) {
    for (const std::size_t triangles : {2000u, 777u, 100u, 30u}) {
      const ReducedMesh reduced = reduce(mesh, triangles);
      EXPECT_LE(reduced.mesh.triangles.size(), triangles);
      EXPECT_GE(reduced.mesh.triangles.size() + 1, triangles);
      EXPECT_THAT(testing::surface_faults(reduced.mesh), IsEmpty());
      EXPECT_EQ(testing::euler_number(reduced.mesh), testing::euler_number(mesh));
      expect_accounted(reduced, mesh);
    }
  }
}

TEST(LindstromTurk, KeepsMeshesThatAreSmallEnough) {
  TriangleMesh mesh = testing::mesh_of(hills(9));
  for (glm::dvec3& p : mesh.vertices_m) p += glm::dvec3(412345.678, 5312345.123, 0.1);
  for (const std::size_t triangles : {128u, 129u, 1000u}) {
    const ReducedMesh reduced = reduce(mesh, triangles);
    EXPECT_EQ(reduced.mesh.vertices_m, mesh.vertices_m);
    EXPECT_EQ(reduced.mesh.triangles, mesh.triangles);
  }
}

// The placement equalises the volumes on both sides of the change: Lindstrom and Turk (1998), 3.2.
TEST(LindstromTurk, KeepsTheVolume) {
  const TriangleMesh ball = testing::icosphere(3, 4).mesh;
  const double volume_m3 = testing::volume_m3(ball);
  for (const std::size_t triangles : {1000u, 200u, 60u}) {
    // Thousands of placements, each solved to some 1e-13.
    EXPECT_NEAR(testing::volume_m3(reduce(ball, triangles).mesh), volume_m3, 1e-9 * volume_m3);
  }
}

TEST(LindstromTurk, KeepsAPlaneAndItsBorder) {
  const TriangleMesh flat = testing::mesh_of(plane(21));
  const ReducedMesh reduced = reduce(flat, 40);
  EXPECT_LE(reduced.mesh.triangles.size(), 40u);
  for (const glm::dvec3& p : reduced.mesh.vertices_m) EXPECT_NEAR(p.z, 2, 1e-12);
  EXPECT_NEAR(testing::area_m2(reduced.mesh), 400, 1e-9);
  EXPECT_LT(MeshDistance(flat, reduced.mesh).largest(1e-6).at_most_m, 1e-5);
}

TEST(LindstromTurk, MakesNoOverhangs) {
  const HeightGrid rough = testing::fractal(65, 1, 30, Seed{5});
  const TriangleMesh mesh = testing::mesh_of(rough);
  ASSERT_EQ(testing::folds_in_plan(mesh), 0u);
  for (const std::size_t triangles : {2000u, 300u, 40u}) {
    const ReducedMesh reduced = reduce(mesh, triangles);
    EXPECT_TRUE(reduced.is_height_field);
    EXPECT_EQ(testing::folds_in_plan(reduced.mesh), 0u);
    EXPECT_THAT(testing::surface_faults(reduced.mesh), IsEmpty());
  }
  EXPECT_FALSE(reduce(testing::icosphere(3, 2).mesh, 100).is_height_field);
}

// Cells of 10 nm, at positions rounded to about 1 nm.
TEST(LindstromTurk, MakesNoOverhangsByRounding) {
  TriangleMesh mesh = testing::mesh_of(testing::fractal(65, 1, 30, Seed{5}));
  for (glm::dvec3& p : mesh.vertices_m) p = 1e-8 * p + glm::dvec3(5e5, 5e6, 300);
  ASSERT_EQ(testing::folds_in_plan(mesh), 0u);
  for (const std::size_t triangles : {4000u, 2000u, 300u, 40u})
    EXPECT_EQ(testing::folds_in_plan(reduce(mesh, triangles).mesh), 0u) << triangles;
}

// Heights and the shift are multiples of 2^-10 m: positions about the origin are the same.
// Quantised files and seams hold vertices at one place. Every fourth column lies on the next.
TEST(LindstromTurk, CollapsesEdgesWithoutLengthDownToTheRequestedTriangles) {
  TriangleMesh mesh = testing::mesh_of(hills(41));
  for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    if (i % 41 % 4 == 1) mesh.vertices_m[i] = mesh.vertices_m[i + 1];
  }
  ASSERT_EQ(mesh.triangles.size(), 3200u);
  for (const std::size_t triangles : {3199u, 3000u, 2500u, 1500u}) {
    const ReducedMesh reduced = reduce(mesh, triangles);
    EXPECT_LE(reduced.mesh.triangles.size(), triangles);
    EXPECT_GE(reduced.mesh.triangles.size() + 1, triangles);
    expect_accounted(reduced, mesh);
  }
}

// Ring of radius 3 and thickness 1, displaced by up to a third of the length of its edges.
TriangleMesh rough_ring(unsigned around, unsigned across) {
  std::mt19937_64 random(5);
  const double most_m = 2 * std::numbers::pi / across / 3;
  std::uniform_real_distribution<double> offset_m(-most_m, most_m);
  TriangleMesh ring;
  for (unsigned i = 0; i < around; ++i) {
    for (unsigned k = 0; k < across; ++k) {
      const double u = 2 * std::numbers::pi * i / around, v = 2 * std::numbers::pi * k / across;
      const glm::dvec3 away(std::cos(u) * std::cos(v), std::sin(u) * std::cos(v), std::sin(v));
      ring.vertices_m.push_back(glm::dvec3(3 * std::cos(u), 3 * std::sin(u), 0) + away +
                                glm::dvec3(offset_m(random), offset_m(random), offset_m(random)));
      const unsigned next_i = (i + 1) % around * across, next_k = (k + 1) % across;
      const unsigned a = i * across + k, b = next_i + k, c = i * across + next_k,
                     d = next_i + next_k;
      ring.triangles.emplace_back(a, b, d);
      ring.triangles.emplace_back(a, d, c);
    }
  }
  return ring;
}

// Each call makes one collapse, after which the triangles that remain are those before, with the
// corners that theirs became.
TEST(LindstromTurk, TurnsNoTriangleOver) {
  TriangleMesh before = rough_ring(40, 20);
  while (before.triangles.size() > 400) {
    const ReducedMesh after = reduce(before, before.triangles.size() - 1);
    ASSERT_EQ(after.mesh.triangles.size() + 2, before.triangles.size());
    std::size_t left = 0;
    for (const glm::uvec3& t : before.triangles) {
      const glm::uvec3 now(after.became[t.x], after.became[t.y], after.became[t.z]);
      if (now.x == now.y || now.y == now.z || now.z == now.x) continue;
      ++left;
      EXPECT_GE(glm::dot(area_vector_m2(before, t), area_vector_m2(after.mesh, now)), 0);
    }
    EXPECT_EQ(left, after.mesh.triangles.size());
    before = after.mesh;
  }
}

TEST(LindstromTurk, DoesNotDependOnTheOrigin) {
  TriangleMesh near = testing::mesh_of(hills(33));
  for (glm::dvec3& p : near.vertices_m) p.z = std::round(1024 * p.z) / 1024;
  TriangleMesh far = near;
  const glm::dvec3 shift_m(524288, 5242880, 512);
  for (glm::dvec3& p : far.vertices_m) p += shift_m;
  const ReducedMesh a = reduce(near, 300), b = reduce(far, 300);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
  EXPECT_EQ(a.sources, b.sources);
  ASSERT_EQ(a.mesh.vertices_m.size(), b.mesh.vertices_m.size());
  for (std::size_t i = 0; i < a.mesh.vertices_m.size(); ++i)  // an ulp there is 1e-9 m
    EXPECT_LT(glm::distance(a.mesh.vertices_m[i] + shift_m, b.mesh.vertices_m[i]), 2e-9);
}

TEST(LindstromTurk, IsReproducible) {
  const TriangleMesh mesh = testing::mesh_of(testing::fractal(65, 1, 20, Seed{1}));
  const ReducedMesh once = reduce(mesh, 500), again = reduce(mesh, 500);
  EXPECT_EQ(once.mesh.vertices_m, again.mesh.vertices_m);
  EXPECT_EQ(once.mesh.triangles, again.mesh.triangles);
  EXPECT_EQ(once.became, again.became);
}

TEST(LindstromTurk, CutsAndCountsNonManifoldParts) {
  TriangleMesh mesh = testing::mesh_of(hills(21));
  mesh.vertices_m.insert(mesh.vertices_m.end(), {{3.2, 3.2, 9}, {3.2, 4, -9}, {50, 50, 0}});
  mesh.triangles.emplace_back(66, 67, 441);     // fin on an edge
  mesh.triangles.push_back(mesh.triangles[7]);  // duplicate
  mesh.triangles.emplace_back(5, 5, 9);
  const ReducedMesh reduced = reduce(mesh, 100);
  EXPECT_EQ(reduced.tangled_edges, 1u);
  EXPECT_EQ(reduced.dropped, 2u);
  EXPECT_THAT(testing::surface_faults(reduced.mesh), IsEmpty());
  EXPECT_LE(reduced.mesh.triangles.size(), 100u);
  EXPECT_EQ(reduced.became[442], 0xffffffff) << "no triangle has it";
  EXPECT_NE(reduced.became[441], 0xffffffff);
}

TEST(LindstromTurk, MakesASurfaceOfAnyTriangles) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> place(-1, 1);
  for (int trial = 0; trial < 300; ++trial) {
    TriangleMesh mesh;
    const auto vertices = 3 + random() % 20, triangles = 1 + random() % 60;
    for (std::size_t i = 0; i < vertices; ++i) {
      const double x = place(random), y = place(random);
      mesh.vertices_m.emplace_back(x, y, trial % 3 == 0 ? 0 : place(random));
    }
    if (trial % 5 == 0) std::ranges::fill(mesh.vertices_m, glm::dvec3(1, 2, 3));
    const auto any = [&] { return static_cast<unsigned>(random() % vertices); };
    for (std::size_t i = 0; i < triangles; ++i) {
      const unsigned a = any(), b = any();
      mesh.triangles.emplace_back(a, b, any());
    }
    const ReducedMesh reduced = reduce(mesh, 1 + random() % triangles);
    EXPECT_THAT(testing::surface_faults(reduced.mesh), IsEmpty()) << "trial " << trial;
    for (const glm::dvec3& p : reduced.mesh.vertices_m) EXPECT_TRUE(std::isfinite(glm::length(p)));
  }
}

// Disc of needles round its centre.
TriangleMesh fan_of(unsigned count) {
  TriangleMesh disc{{{0, 0, 0}}, {}, {}};
  for (unsigned i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    disc.vertices_m.emplace_back(std::cos(angle), std::sin(angle), 0);
    disc.triangles.emplace_back(0, 1 + i, 1 + (i + 1) % count);
  }
  return disc;
}

// CPU time to reduce a fan to half, minimum of several runs: other processes only lengthen it.
double fan_time_s(unsigned count) {
  const TriangleMesh disc = fan_of(count);
  double least_s = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const std::clock_t begin = std::clock();
    EXPECT_LE(reduce(disc, count / 2).mesh.triangles.size(), count / 2);
    least_s = std::min(least_s, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  return least_s;
}

// Each collapse changes the cost of all edges at the centre, and CGAL visits all triangles there
// for each: time grows with the cube, 8-fold, but not with the fourth power, 16-fold. The limit is
// between these.
TEST(LindstromTurk, ReducesAFanInCubicTime) {
  constexpr double most = 12;
  const double found = fan_time_s(200) / fan_time_s(100);
  EXPECT_LT(found, most);
  testing::record_margin("fan of 200 triangles to half: CPU time over that of 100", found, most);
}

TEST(LindstromTurk, ReportsProgressWithinAFan) {
  std::size_t reported = 0;
  reduce(fan_of(280), 140, {.progress = [&](double) { ++reported; }});
  EXPECT_GT(reported, 50u);
}

TEST(LindstromTurk, KeepsOneTriangle) {
  const TriangleMesh one{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  EXPECT_EQ(reduce(one, 1).mesh.triangles, one.triangles);
}

TEST(LindstromTurk, RejectsInvalidInput) {
  const auto message = [](const TriangleMesh& mesh, std::size_t triangles, const RunControl& work) {
    try {
      reduce(mesh, triangles, work);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  TriangleMesh mesh = testing::mesh_of(hills(5));
  EXPECT_THAT(message(mesh, 0, {}), HasSubstr("triangles = 0 must be at least 1"));
  EXPECT_THAT(message({}, 5, {}), HasSubstr("there is no triangle"));
  EXPECT_THAT(message(mesh, 5, {.most_bytes = 1000}), HasSubstr("32 triangles take about"));
  mesh.vertices_m[3].z = std::nan("");
  EXPECT_THAT(message(mesh, 5, {}), HasSubstr("vertex 3 must have a finite position"));
}

TEST(LindstromTurk, ReportsProgressAndStopsOnRequest) {
  const TriangleMesh mesh = testing::mesh_of(hills(81));
  std::vector<double> shares;
  reduce(mesh, 100, {.progress = [&](double share) { shares.push_back(share); }});
  ASSERT_GT(shares.size(), 3u);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_EQ(shares.back(), 1);
  const RunControl work{.progress = [](double) { throw std::runtime_error("enough"); }};
  EXPECT_THROW(reduce(mesh, 100, work), std::runtime_error);
}

}  // namespace
}  // namespace groundray::lindstrom_turk_test
