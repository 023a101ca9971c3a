#include "reconstruction/mesh/holes/hole_fill.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <glm/geometric.hpp>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/error.h"
#include "reconstruction/mesh/holes/hole_patch.h"
#include "test/support/margin.h"
#include "test/support/scans/solid.h"
#include "test/support/scans/stanford_bunny.h"
#include "test/support/terrain/surface_check.h"

namespace groundray::hole_fill_test {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Sheet of unit cells in the plane z = 0.
TriangleMesh sheet(int cells) {
  TriangleMesh mesh;
  const auto wide = static_cast<unsigned>(cells) + 1;
  for (int row = 0; row <= cells; ++row) {
    for (int column = 0; column <= cells; ++column) mesh.vertices_m.emplace_back(column, row, 0);
  }
  for (unsigned row = 0; row + 1 < wide; ++row) {
    for (unsigned column = 0; column + 1 < wide; ++column) {
      const unsigned a = row * wide + column;
      mesh.triangles.insert(mesh.triangles.end(),
                            {{a, a + 1, a + wide}, {a + 1, a + wide + 1, a + wide}});
    }
  }
  return mesh;
}

glm::dvec3 middle_of(const TriangleMesh& mesh, const glm::uvec3& t) {
  return (mesh.vertices_m[t.x] + mesh.vertices_m[t.y] + mesh.vertices_m[t.z]) / 3.0;
}

// Mesh without the triangles whose centroids satisfy `is_gone`.
TriangleMesh without(TriangleMesh mesh, const std::function<bool(const glm::dvec3&)>& is_gone) {
  std::erase_if(mesh.triangles, [&](const glm::uvec3& t) { return is_gone(middle_of(mesh, t)); });
  return mesh;
}

TriangleMesh ball_without_cap(double cap_rad, int splits = 4) {
  return without(testing::icosphere(1, splits).mesh,
                 [&](const glm::dvec3& p) { return glm::normalize(p).z > std::cos(cap_rad); });
}

FilledMesh filled(const TriangleMesh& mesh, double longest_m) {
  return fill_holes({.shape = mesh}, {.longest_m = longest_m});
}

// Invariants of every filled mesh.
void expect_sound(const FilledMesh& out, const TriangleMesh& before) {
  const TriangleMesh& after = out.mesh.shape;
  ASSERT_EQ(out.measured_triangles, before.triangles.size());
  ASSERT_EQ(out.measured_vertices, before.vertices_m.size());
  EXPECT_TRUE(
      std::equal(before.triangles.begin(), before.triangles.end(), after.triangles.begin()));
  EXPECT_TRUE(
      std::equal(before.vertices_m.begin(), before.vertices_m.end(), after.vertices_m.begin()));
  EXPECT_THAT(crossings(after, static_cast<std::uint32_t>(before.triangles.size())), IsEmpty());
  std::size_t triangle = before.triangles.size(), vertex = before.vertices_m.size();
  for (const FilledHole& hole : out.filled) {
    EXPECT_EQ(hole.first_triangle, triangle);
    EXPECT_EQ(hole.first_vertex, vertex);
    triangle += hole.triangles;
    vertex += hole.vertices;
  }
  EXPECT_EQ(triangle, after.triangles.size());
  EXPECT_EQ(vertex, after.vertices_m.size());
}

std::vector<HoleLeft> reasons(const FilledMesh& out) {
  std::vector<HoleLeft> why;
  for (const OpenHole& hole : out.left) why.push_back(hole.why);
  return why;
}

TEST(HoleFill, ClosesABallSmoothly) {
  struct Case {
    double cap_rad, most_m;
  };
  // A thin plate over a disk that continues the slope at its boundary is a paraboloid, which is
  // higher than the cap. Triangles determine the boundary's slope to half an edge. Large caps do
  // better: the last bound is tighter than that.
  constexpr double edge_rad = 1.1071 / 16;  // of an icosahedron split four times
  for (const auto& [cap_rad, most_m] : {Case{0.2, 5e-3}, Case{0.4, 1.5e-2}, Case{0.8, 0.06}}) {
    const double paraboloid_m = std::sin(cap_rad) * std::tan(cap_rad + edge_rad / 2) / 2;
    const double tolerance_m = std::min(most_m, paraboloid_m - (1 - std::cos(cap_rad)));
    const TriangleMesh open = ball_without_cap(cap_rad);
    const FilledMesh out = filled(open, 10);
    expect_sound(out, open);
    EXPECT_THAT(testing::surface_faults(out.mesh.shape), IsEmpty());
    EXPECT_EQ(testing::border_edges(out.mesh.shape), 0u);
    EXPECT_EQ(testing::euler_number(out.mesh.shape), 2);
    ASSERT_EQ(out.filled.size(), 1u);
    EXPECT_TRUE(out.filled[0].is_smooth);
    EXPECT_GT(out.filled[0].vertices, 3u);
    double largest_m = 0;
    for (std::size_t i = out.measured_vertices; i < out.mesh.shape.vertices_m.size(); ++i)
      largest_m = std::max(largest_m, std::abs(glm::length(out.mesh.shape.vertices_m[i]) - 1));
    EXPECT_LT(largest_m, tolerance_m);
    testing::record_margin(fmt::format("cap of {} rad of a unit ball, filled in", cap_rad),
                           largest_m, tolerance_m, "m");
  }
}

TEST(HoleFill, ClosesAPlaneExactlyAtAnyPosition) {
  for (const glm::dvec3& origin_m : {glm::dvec3(0), glm::dvec3(412345, 5312345, 200)}) {
    TriangleMesh whole = sheet(20);
    for (glm::dvec3& p : whole.vertices_m) p = origin_m + glm::dvec3(p.x, p.y, p.x / 4 - p.y / 2);
    const TriangleMesh open = without(whole, [&](const glm::dvec3& p) {
      return glm::length(glm::dvec2(p - origin_m) - 10.0) < 5;
    });
    const FilledMesh out = filled(open, 100);
    expect_sound(out, open);
    EXPECT_EQ(reasons(out), std::vector{HoleLeft::Outline});
    EXPECT_NEAR(out.left[0].boundary.length_m, 40 * (std::sqrt(1 + 1. / 16) + std::sqrt(1.25)),
                1e-6);
    ASSERT_EQ(out.filled.size(), 1u);
    EXPECT_EQ(testing::border_edges(out.mesh.shape), 80u);
    EXPECT_EQ(testing::euler_number(out.mesh.shape), 1);
    // An ulp of such northings is 1e-9 m, and the equations are solved to some 1e-12.
    EXPECT_NEAR(testing::area_m2(out.mesh.shape), testing::area_m2(whole), 1e-5);
    for (std::size_t i = out.measured_vertices; i < out.mesh.shape.vertices_m.size(); ++i) {
      const glm::dvec3 p = out.mesh.shape.vertices_m[i] - origin_m;
      EXPECT_NEAR(p.z, p.x / 4 - p.y / 2, 1e-8);
    }
  }
}

TEST(HoleFill, ClosesTheWallAndTheEndsOfATube) {
  TriangleMesh tube;
  constexpr unsigned sides = 48, rings = 40;
  for (unsigned ring = 0; ring <= rings; ++ring) {
    for (unsigned side = 0; side < sides; ++side) {
      const double angle = 2 * pi * side / sides;
      tube.vertices_m.emplace_back(std::cos(angle), std::sin(angle), 0.13 * ring);
    }
  }
  for (unsigned ring = 0; ring < rings; ++ring) {
    for (unsigned side = 0; side < sides; ++side) {
      const unsigned a = sides * ring + side, b = sides * ring + (side + 1) % sides;
      tube.triangles.insert(tube.triangles.end(), {{a, b, b + sides}, {a, b + sides, a + sides}});
    }
  }
  const TriangleMesh open =
      without(tube, [](const glm::dvec3& p) { return p.x > 0.8 && std::abs(p.z - 2.6) < 0.5; });
  const FilledMesh wall = filled(open, 5);  // the ends have a circumference of 6.28 m
  expect_sound(wall, open);
  EXPECT_EQ(reasons(wall), (std::vector{HoleLeft::TooLong, HoleLeft::TooLong}));
  EXPECT_NEAR(wall.left[0].boundary.length_m, 2 * pi, 1e-2);
  ASSERT_EQ(wall.filled.size(), 1u);
  for (std::size_t i = wall.measured_vertices; i < wall.mesh.shape.vertices_m.size(); ++i)
    EXPECT_NEAR(glm::length(glm::dvec2(wall.mesh.shape.vertices_m[i])), 1, 0.03);
  const FilledMesh all = filled(open, 7);
  expect_sound(all, open);
  EXPECT_EQ(testing::border_edges(all.mesh.shape), 0u);
  EXPECT_EQ(testing::euler_number(all.mesh.shape), 2);
}

TEST(HoleFill, KeepsTheOutlineOfADomeAndFillsTheHoleOfABall) {
  const auto rest = [](double lowest) {
    return without(testing::icosphere(1, 4).mesh,
                   [=](const glm::dvec3& p) { return p.z < lowest; });
  };
  EXPECT_EQ(reasons(filled(rest(0.7), 100)), std::vector{HoleLeft::Outline});
  EXPECT_EQ(filled(rest(0.1), 100).filled.size(), 1u);
  EXPECT_EQ(filled(rest(-0.7), 100).filled.size(), 1u);
}

TEST(HoleFill, KeepsLargeHolesOpen) {
  const TriangleMesh open = without(sheet(20), [](const glm::dvec3& p) {
    return (std::abs(p.x - 10) < 4 && std::abs(p.y - 10) < 4) || glm::length(p - 3.0) < 3.2;
  });
  const FilledMesh small = filled(open, 31);
  expect_sound(small, open);
  EXPECT_EQ(small.filled.size(), 1u);
  ASSERT_EQ(reasons(small), (std::vector{HoleLeft::Outline, HoleLeft::TooLong}));
  EXPECT_NEAR(small.left[1].boundary.length_m, 32, 1e-12);
  EXPECT_EQ(small.left[1].boundary.vertices.size(), 32u);
  EXPECT_LT(glm::distance(small.left[1].boundary.middle_m, glm::dvec3(10, 10, 0)), 1e-12);
  const FilledMesh few = fill_holes({.shape = open}, {.longest_m = 100, .most_edges = 31});
  EXPECT_EQ(reasons(few), (std::vector{HoleLeft::Outline, HoleLeft::TooManyEdges}));
  EXPECT_EQ(reasons(filled(open, 0)).size(), 3u) << "nothing is filled without a limit";
}

TEST(HoleFill, JoinsIslandsInAHoleOrFillsBelowThem) {
  const auto is_moat = [](const glm::dvec3& p) {
    const double apart = glm::length(glm::dvec2(p) - glm::dvec2(10, 10));
    const double other = glm::length(glm::dvec2(p) - glm::dvec2(12, 13));
    return apart > 1.5 && apart < 6 && other > 1;
  };
  const TriangleMesh flat = without(sheet(20), is_moat);
  const FilledMesh joined = filled(flat, 100);
  expect_sound(joined, flat);
  EXPECT_EQ(reasons(joined), std::vector{HoleLeft::Outline});
  ASSERT_EQ(joined.filled.size(), 1u);
  EXPECT_EQ(joined.filled[0].islands, 2u);
  EXPECT_THAT(testing::surface_faults(joined.mesh.shape), IsEmpty());
  EXPECT_EQ(testing::euler_number(joined.mesh.shape), 1);
  EXPECT_NEAR(testing::area_m2(joined.mesh.shape), 400, 1e-9);
  TriangleMesh raised = flat;
  for (glm::dvec3& p : raised.vertices_m)
    if (glm::length(glm::dvec2(p) - glm::dvec2(11, 11)) < 4) p.z = 1;
  const FilledMesh below = filled(raised, 100);
  expect_sound(below, raised);
  ASSERT_EQ(below.filled.size(), 1u);
  EXPECT_EQ(below.filled[0].islands, 0u) << "the ground goes on below";
  EXPECT_EQ(testing::euler_number(below.mesh.shape), 3);
}

// A ribbon along a trefoil knot: every surface bounded by its boundary crosses itself.
TEST(HoleFill, KeepsKnottedBoundariesOpen) {
  TriangleMesh ribbon;
  constexpr unsigned steps = 90;
  for (unsigned i = 0; i < steps; ++i) {
    const double s = 2 * pi * i / steps;
    const glm::dvec3 p(std::sin(s) + 2 * std::sin(2 * s), std::cos(s) - 2 * std::cos(2 * s),
                       -std::sin(3 * s));
    ribbon.vertices_m.push_back(p + glm::dvec3(0, 0, 0.05));
    ribbon.vertices_m.push_back(p - glm::dvec3(0, 0, 0.05));
    const unsigned a = 2 * i, b = 2 * ((i + 1) % steps);
    ribbon.triangles.insert(ribbon.triangles.end(), {{a, a + 1, b}, {b, a + 1, b + 1}});
  }
  const FilledMesh out = filled(ribbon, 1000);
  expect_sound(out, ribbon);
  EXPECT_EQ(out.filled.size(), 0u);
  ASSERT_EQ(out.left.size(), 2u);
  for (const OpenHole& hole : out.left)
    EXPECT_TRUE(hole.why == HoleLeft::Crossing || hole.why == HoleLeft::NoFilling);
}

TEST(HoleFill, KeepsNonManifoldBoundariesOpen) {
  TriangleMesh open = without(sheet(10), [](const glm::dvec3& p) {
    return std::abs(p.x - 5) < 1 && std::abs(p.y - 5) < 1;
  });
  open.vertices_m.insert(open.vertices_m.end(), {{4.5, 4, 1}, {4.5, 4, -1}});
  open.triangles.insert(open.triangles.end(), {{48, 49, 121}, {48, 49, 122}});
  const FilledMesh out = filled(open, 100);
  EXPECT_EQ(out.filled.size(), 0u);
  EXPECT_EQ(std::ranges::count(reasons(out), HoleLeft::NotManifold), 3) << "hole and two fins";
}

TEST(HoleFill, IgnoresTrianglesThatRepeatAVertex) {
  TriangleMesh open = without(sheet(5), [](const glm::dvec3& p) {
    return std::abs(p.x - 2.5) < 0.5 && std::abs(p.y - 2.5) < 0.5;
  });
  open.vertices_m[14].z = open.vertices_m[21].z = 0.1;  // opposite corners of the hole
  ASSERT_EQ(filled(open, 10).filled.size(), 1u);
  open.triangles.emplace_back(14, 21, 21);
  EXPECT_EQ(filled(open, 10).filled.size(), 1u);
}

TEST(HoleFill, ClosesHolesThatTouchAtAVertex) {
  const TriangleMesh open = without(sheet(12), [](const glm::dvec3& p) {
    const auto is_in = [&](double x, double y) {
      return std::abs(p.x - x) < 1 && std::abs(p.y - y) < 1;
    };
    return is_in(4, 4) || is_in(6, 6) || is_in(8, 4);
  });
  const FilledMesh out = filled(open, 100);
  expect_sound(out, open);
  EXPECT_EQ(out.filled.size(), 3u);
  EXPECT_THAT(testing::surface_faults(out.mesh.shape), IsEmpty());
  EXPECT_EQ(testing::euler_number(out.mesh.shape), 1);
  EXPECT_NEAR(testing::area_m2(out.mesh.shape), 144, 1e-9);
}

TEST(HoleFill, KeepsMeasuredAttributesAndMarksFilledVertices) {
  MeasuredMesh mesh{.shape = ball_without_cap(0.5)};
  for (const glm::dvec3& p : mesh.shape.vertices_m) {
    mesh.sd_m.push_back(static_cast<float>(0.01 + 0.005 * p.x));
    mesh.labels.push_back(p.x > 0 ? 7 : 3);
    mesh.confidence.push_back(0.5f);
  }
  const FilledMesh out = fill_holes(mesh, {.longest_m = 10});
  ASSERT_EQ(out.filled.size(), 1u);
  ASSERT_EQ(out.mesh.sd_m.size(), out.mesh.shape.vertices_m.size());
  ASSERT_EQ(out.mesh.labels.size(), out.mesh.shape.vertices_m.size());
  ASSERT_EQ(out.mesh.confidence.size(), out.mesh.shape.vertices_m.size());
  EXPECT_TRUE(std::equal(mesh.sd_m.begin(), mesh.sd_m.end(), out.mesh.sd_m.begin()));
  for (std::size_t i = out.measured_vertices; i < out.mesh.sd_m.size(); ++i) {
    const glm::dvec3& p = out.mesh.shape.vertices_m[i];
    double apart_m = 10;
    for (const std::uint32_t v : out.filled[0].boundary.vertices)
      apart_m = std::min(apart_m, glm::distance(p, mesh.shape.vertices_m[v]));
    EXPECT_NEAR(out.mesh.sd_m[i], std::hypot(0.01 + 0.005 * p.x, apart_m / 3), 0.001);
    EXPECT_EQ(out.mesh.confidence[i], 0);
    if (std::abs(p.x) > 0.1) {
      EXPECT_EQ(out.mesh.labels[i], p.x > 0 ? 7 : 3);
    }
  }
}

TriangleMesh torn(std::size_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> chance(0, 1);
  TriangleMesh mesh = testing::icosphere(1, 4).mesh;
  for (glm::dvec3& p : mesh.vertices_m)
    p *= 1 + 0.1 * std::sin(5 * p.x) * std::cos(4 * p.y) + 0.005 * chance(random);
  std::vector<glm::dvec3> holes;
  for (int i = 0; i < 12; ++i) {
    const double x = chance(random) - 0.5, y = chance(random) - 0.5;
    holes.push_back(glm::normalize(glm::dvec3(x, y, chance(random) - 0.5)));
  }
  return without(mesh, [&](const glm::dvec3& p) {  // round holes with jagged boundaries, and specks
    const bool is_in = std::ranges::any_of(holes, [&](const glm::dvec3& hole) {
      return glm::distance(hole, glm::normalize(p)) < 0.12 + 0.08 * chance(random);
    });
    return is_in || chance(random) < 0.01;
  });
}

TEST(HoleFill, ClosesJaggedHoles) {
  std::size_t closed = 0, left = 0;
  for (std::size_t seed = 0; seed < 12; ++seed) {
    const TriangleMesh open = torn(seed);
    const FilledMesh out = filled(open, 10);
    expect_sound(out, open);
    closed += out.filled.size();
    for (const OpenHole& hole : out.left) left += hole.why != HoleLeft::Outline;
    std::size_t borders = 0;
    for (const OpenHole& hole : out.left) borders += hole.boundary.vertices.size();
    EXPECT_EQ(testing::border_edges(out.mesh.shape), borders) << "each boundary is filled or left";
    for (const std::string& fault : testing::surface_faults(out.mesh.shape))
      EXPECT_THAT(fault, HasSubstr("joins")) << "edges must have two triangles; seed " << seed;
  }
  EXPECT_GT(closed, 100u);
  EXPECT_LT(static_cast<double>(left), 0.1 * static_cast<double>(closed))
      << "those with a triangle in them that hangs on the boundary by a corner";
}

TEST(HoleFill, DoesNotDependOnThreads) {
  const TriangleMesh open = torn(99);
  const FilledMesh some = filled(open, 10);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const FilledMesh alone = filled(open, 10);
  EXPECT_EQ(some.mesh.shape.vertices_m, alone.mesh.shape.vertices_m);
  EXPECT_EQ(some.mesh.shape.triangles, alone.mesh.shape.triangles);
}

TEST(HoleFill, KeepsMeshesWithoutHoles) {
  EXPECT_TRUE(filled({}, 10).mesh.shape.triangles.empty());
  const TriangleMesh ball = testing::icosphere(1, 2).mesh;
  const FilledMesh out = filled(ball, 10);
  EXPECT_EQ(out.mesh.shape.triangles, ball.triangles);
  EXPECT_TRUE(out.left.empty());
  const TriangleMesh one{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  EXPECT_EQ(reasons(filled(one, 10)), std::vector{HoleLeft::Outline});
}

TEST(HoleFill, TerminatesForAnyTriangles) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> place(-1, 1);
  for (int trial = 0; trial < 300; ++trial) {
    TriangleMesh mesh;
    const auto vertices = 3 + random() % 20, triangles = random() % 60;
    for (std::size_t i = 0; i < vertices; ++i) {
      const double x = place(random), y = place(random);
      mesh.vertices_m.emplace_back(x, y, trial % 3 == 0 ? 0 : place(random));
    }
    if (trial % 10 == 0) std::ranges::fill(mesh.vertices_m, glm::dvec3(1, 2, 3));
    const auto any = [&] { return static_cast<unsigned>(random() % vertices); };
    for (std::size_t i = 0; i < triangles; ++i) {
      const unsigned a = any(), b = any();
      mesh.triangles.emplace_back(a, b, any());
    }
    expect_sound(filled(mesh, 100), mesh);
  }
}

TEST(HoleFill, RejectsInvalidInput) {
  const auto message = [](const MeasuredMesh& mesh, double longest_m, const RunControl& work) {
    try {
      fill_holes(mesh, {.longest_m = longest_m}, work);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  MeasuredMesh mesh{.shape = sheet(3)};
  EXPECT_THAT(message(mesh, -1, {}), HasSubstr("longest_m = -1 must be 0"));
  EXPECT_THAT(message(mesh, std::nan(""), {}), HasSubstr("longest_m = nan must be 0"));
  EXPECT_THAT(message(mesh, 1, {.most_bytes = 100}), HasSubstr("18 triangles take about"));
  mesh.sd_m.resize(5);
  mesh.labels.resize(6);
  mesh.confidence.resize(7);
  EXPECT_THAT(message(mesh, 1, {}),
              ::testing::AllOf(HasSubstr("sd_m has 5 values for 16 vertices"),
                               HasSubstr("labels has 6"), HasSubstr("confidence has 7")));
  mesh.shape.vertices_m[2].y = std::nan("");
  EXPECT_THAT(message(mesh, 1, {}), HasSubstr("vertex 2 must have a finite position"));
}

TEST(HoleFill, ReportsProgressAndStopsOnRequest) {
  const TriangleMesh open = torn(1);
  std::vector<double> shares;
  fill_holes({.shape = open}, {.longest_m = 10},
             {.progress = [&](double share) { shares.push_back(share); }});
  ASSERT_GT(shares.size(), 5u);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_EQ(shares.back(), 1);
  const RunControl work{.progress = [](double) { throw std::runtime_error("enough"); }};
  EXPECT_THROW(fill_holes({.shape = open}, {.longest_m = 10}, work), std::runtime_error);
}

TEST(HoleFill, ClosesTheBunny) {
  const std::optional<TriangleMesh> bunny = testing::stanford_bunny();
  if (!bunny) GTEST_SKIP() << testing::no_bunny;
  const TriangleMesh& open = *bunny;
  const FilledMesh out = filled(open, 1);
  expect_sound(out, open);
  EXPECT_EQ(out.filled.size(), 5u) << "three where it stood, two larger ones beneath";
  EXPECT_TRUE(out.left.empty());
  EXPECT_THAT(testing::surface_faults(out.mesh.shape), IsEmpty());
  EXPECT_EQ(testing::border_edges(out.mesh.shape), 0u);
  EXPECT_EQ(testing::euler_number(out.mesh.shape), 2);
}

}  // namespace
}  // namespace groundray::hole_fill_test
