#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "reconstruction/mesh/simplify/decimation_state.h"
#include "reconstruction/mesh/simplify/simplify.h"
#include "test/support/terrain/plan_check.h"

namespace groundray::simplify_terrain_test {
namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

// Grid of cells of 1 m whose samples are displaced by up to `jitter_m` each way; heights are waves
// plus noise. Cells within a disc are omitted if it has a radius.
TriangleMesh random_terrain(int cells, double jitter_m, double noise_m, double hole_m,
                            Random& random) {
  TriangleMesh mesh;
  const double phase = uniform(random, 0, 6);
  for (int row = 0; row <= cells; ++row) {
    for (int column = 0; column <= cells; ++column) {
      glm::dvec3 p(column + uniform(random, -jitter_m, jitter_m),
                   row + uniform(random, -jitter_m, jitter_m), 0);
      p.z = 2 * std::sin(0.2 * p.x + phase) * std::cos(0.17 * p.y) +
            uniform(random, -noise_m, noise_m);
      mesh.vertices_m.push_back(p);
    }
  }
  const auto side = static_cast<unsigned>(cells + 1);
  for (unsigned row = 0; row + 1 < side; ++row) {
    for (unsigned column = 0; column + 1 < side; ++column) {
      if (std::hypot(column - 0.4 * cells, row - 0.6 * cells) < hole_m) continue;
      const unsigned a = row * side + column, b = a + 1, c = a + side, d = c + 1;
      if (random() % 2 == 0) {
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {b, d, c}});
      } else {
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, d}, {a, d, c}});
      }
    }
  }
  return mesh;
}

std::vector<glm::dvec3> used_vertices(const TriangleMesh& mesh) {
  std::vector<bool> is_used(mesh.vertices_m.size());
  for (const glm::uvec3& t : mesh.triangles) is_used[t.x] = is_used[t.y] = is_used[t.z] = true;
  std::vector<glm::dvec3> used;
  for (std::size_t i = 0; i < is_used.size(); ++i) {
    if (is_used[i]) used.push_back(mesh.vertices_m[i]);
  }
  return used;
}

// Distance of a point from a border, and its height above or below the nearest border point in
// plan.
struct FromBorder {
  double aside_m = std::numeric_limits<double>::infinity();
  double above_m = 0;
};

using Border = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

FromBorder from_border(const glm::dvec3& p, const TriangleMesh& mesh, const Border& border) {
  FromBorder found;
  for (const auto& [from, to] : border) {
    const glm::dvec3 &a = mesh.vertices_m[from], &b = mesh.vertices_m[to];
    const glm::dvec2 edge(b - a), d(p - a);
    const double share = std::clamp(glm::dot(edge, d) / glm::dot(edge, edge), 0.0, 1.0);
    const double aside_m = glm::length(d - share * edge);
    if (aside_m >= found.aside_m) continue;
    found = {aside_m, std::abs(a.z + share * (b.z - a.z) - p.z)};
  }
  return found;
}

TEST(SimplifyTerrain, APlaneBecomesTwoTriangles) {
  TriangleMesh mesh;
  Random random(1);
  mesh = random_terrain(40, 0, 0, 0, random);
  for (glm::dvec3& p : mesh.vertices_m) p.z = 0.3 * p.x - 0.7 * p.y + 12;
  const Simplified result = simplify({mesh}, VerticalBound{.error_m = 1e-9});
  EXPECT_EQ(result.mesh.shape.triangles.size(), 2u);
  EXPECT_EQ(result.halted_by, HaltReason::Bound);
  EXPECT_LE(result.error.largest().at_least_m, 1e-9);
  EXPECT_LE(testing::check_plan(mesh.vertices_m, result.mesh.shape).largest_m, 1e-9);
}

// Oracle: the evaluator searches triangles above and below each vertex independently.
TEST(SimplifyTerrain, EveryVertexIsWithinTheBound) {
  Random random(2);
  for (int i = 0; i < 12; ++i) {
    const bool is_even = i % 2 == 0;  // a straight border stays in place
    const double hole_m = i % 3 == 2 ? 6 : 0;
    const TriangleMesh mesh = random_terrain(48, is_even ? 0 : 0.2, 0.1 * (i % 4), hole_m, random);
    const double error_m = std::exp2(-(i % 5)), border_m = is_even ? 0 : 0.25;
    const Simplified result = simplify({mesh}, VerticalBound{error_m, border_m});
    const TriangleMesh& coarse = result.mesh.shape;
    EXPECT_LT(coarse.triangles.size(), mesh.triangles.size());
    EXPECT_EQ(testing::manifold_faults(coarse), 0u);
    const std::vector<glm::dvec3> vertices = used_vertices(mesh);
    const Border border = testing::border_of(coarse);
    const testing::PlanCheck check = testing::check_plan(vertices, coarse);
    EXPECT_EQ(check.turned_over, 0u);
    EXPECT_LE(check.largest_m, error_m * (1 + 1e-9));
    if (is_even && hole_m == 0) {
      EXPECT_EQ(check.uncovered, 0u);
      EXPECT_NEAR(check.area_m2, 48 * 48, 1e-6);
      EXPECT_NEAR(result.vertical.value().largest_m, check.largest_m, 1e-9);
      EXPECT_NEAR(result.vertical.value().rms_m, check.rms_m, 1e-9);
    }
    const testing::PlanBins bins(coarse);
    for (const glm::dvec3& p : vertices) {  // uncovered points are beside the border
      if (!bins.heights_m(glm::dvec2(p)).empty()) continue;
      const FromBorder beside = from_border(p, coarse, border);
      EXPECT_LE(beside.aside_m, border_m + 1e-9);
      EXPECT_LE(beside.above_m, error_m * (1 + 1e-9));
    }
  }
}

TEST(SimplifyTerrain, BordersAreWithinTheirBoundInBothDirections) {
  Random random(3);
  for (const double border_m : {0.0, 0.1, 0.7}) {
    const TriangleMesh mesh = random_terrain(40, 0.2, 0.05, 7, random);
    const Simplified result = simplify({mesh}, VerticalBound{.error_m = 0.5, .border_m = border_m});
    const TriangleMesh& coarse = result.mesh.shape;
    const Border before = testing::border_of(mesh), after = testing::border_of(coarse);
    for (const auto& [from, to] : before)
      EXPECT_LE(from_border(mesh.vertices_m[from], coarse, after).aside_m, border_m + 1e-9);
    for (const auto& [from, to] : after) {
      for (const double share : {0.0, 0.25, 0.5, 0.75}) {
        const glm::dvec3 p = (1 - share) * coarse.vertices_m[from] + share * coarse.vertices_m[to];
        EXPECT_LE(from_border(p, mesh, before).aside_m, border_m + 1e-9);
      }
    }
    if (border_m == 0) {
      EXPECT_EQ(after.size(), before.size());
    } else {
      EXPECT_LT(after.size(), before.size());
    }
  }
}

// Two holes with little between them, and tongues that nearly touch: borders that move by more must
// not cross, so that no position is covered twice.
TEST(SimplifyTerrain, MovingBordersDoNotCross) {
  Random random(4);
  for (int i = 0; i < 6; ++i) {
    TriangleMesh mesh = random_terrain(40, 0.2, 0.05, 0, random);
    std::erase_if(mesh.triangles, [&](const glm::uvec3&) { return random() % 5 == 0; });
    const Simplified result = simplify({mesh}, VerticalBound{.error_m = 1, .border_m = 1.5});
    const TriangleMesh& coarse = result.mesh.shape;
    EXPECT_EQ(testing::manifold_faults(coarse), 0u);
    EXPECT_EQ(testing::check_plan({}, coarse).turned_over, 0u);
    const testing::PlanBins bins(coarse);
    for (int k = 0; k < 2000; ++k) {
      const glm::dvec2 p(uniform(random, 0, 40), uniform(random, 0, 40));
      EXPECT_LE(bins.heights_m(p).size(), 1u) << p.x << ' ' << p.y;
    }
  }
}

// Two sheets of cells of 1 m, one `step_m` higher, on either side of a crack: either interlocking
// teeth or a straight crack.
TriangleMesh cracked_terrain(double teeth_m, double gap_m, double step_m, Random& random) {
  constexpr unsigned side = 12;
  TriangleMesh mesh;
  for (int sheet = 0; sheet < 2; ++sheet) {
    const auto first = static_cast<unsigned>(mesh.vertices_m.size());
    for (unsigned row = 0; row < side; ++row) {
      for (unsigned column = 0; column < side; ++column) {
        // Every second row protrudes, most at the crack.
        const unsigned from_afar = sheet == 0 ? column : side - 1 - column;
        const double out_m = row % 2 == 0 ? 0 : teeth_m * from_afar / (side - 1.0);
        const double jitter_m = from_afar == side - 1 && teeth_m == 0 ? 0 : 0.05;
        mesh.vertices_m.emplace_back(
            sheet * (side - 1 + gap_m) + column + out_m + uniform(random, -jitter_m, jitter_m),
            row + uniform(random, -0.05, 0.05), sheet * step_m + uniform(random, 0, 0.3));
      }
    }
    for (unsigned row = 0; row + 1 < side; ++row) {
      for (unsigned column = 0; column + 1 < side; ++column) {
        const unsigned a = first + row * side + column, b = a + 1, c = a + side, d = c + 1;
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {b, d, c}});
      }
    }
  }
  return mesh;
}

// Terrain with a cliff or steep hills, with one triangle in eight omitted.
TriangleMesh torn_terrain(bool has_cliff, Random& random) {
  TriangleMesh mesh = random_terrain(16, 0.1, 0.1, 0, random);
  for (glm::dvec3& p : mesh.vertices_m)
    p.z += has_cliff ? (p.x > 8.4 ? 50 : 0) : 20 * std::sin(0.9 * p.x) + 20 * std::cos(0.7 * p.y);
  std::erase_if(mesh.triangles, [&](const glm::uvec3&) { return random() % 8 == 0; });
  return mesh;
}

// Oracle: exhaustive search of triangles above and below and of the border.
double farthest_above_m(const TriangleMesh& original, const TriangleMesh& coarse) {
  const testing::PlanBins bins(coarse);
  const Border border = testing::border_of(coarse);
  double farthest_m = 0;
  for (const glm::dvec3& p : used_vertices(original)) {
    const std::vector<double> heights_m = bins.heights_m(glm::dvec2(p));
    double above_m = std::numeric_limits<double>::infinity();
    for (const double height_m : heights_m) above_m = std::min(above_m, std::abs(height_m - p.z));
    if (heights_m.empty()) above_m = from_border(p, coarse, border).above_m;
    farthest_m = std::max(farthest_m, above_m);
  }
  return farthest_m;
}

// The area that one border withdrew from may be nearer to another border, which is at another
// height.
TEST(SimplifyTerrain, IsWithinTheBoundWhereBordersMoveOverEachOther) {
  Random random(8);
  std::size_t mended = 0, left = 0, all = 0;
  for (int i = 0; i < 60; ++i) {
    TriangleMesh mesh;
    if (i % 3 == 0) mesh = cracked_terrain(0.8, 0.3, 100, random);
    if (i % 3 == 1) mesh = cracked_terrain(0, i % 2 == 0 ? 0 : 0.2, 100, random);
    if (i % 3 == 2) mesh = torn_terrain(i % 2 == 0, random);
    const VerticalBound stop{1, i % 3 == 2 ? 2.5 : 1};
    const Simplified result = simplify({mesh}, stop, {.crease_rad = 4});
    const TriangleMesh& coarse = result.mesh.shape;
    ASSERT_TRUE(result.vertical);
    EXPECT_LE(result.vertical->largest_m, stop.error_m * (1 + 1e-9));
    EXPECT_LE(result.vertical->aside_m, stop.border_m * (1 + 1e-9));
    EXPECT_LE(farthest_above_m(mesh, coarse), stop.error_m * (1 + 1e-9));
    EXPECT_EQ(testing::check_plan({}, coarse).turned_over, 0u);
    mended += result.rounds > 1 ? 1 : 0;
    left += coarse.triangles.size();
    all += mesh.triangles.size();
  }
  EXPECT_GT(mended, 10u);
  EXPECT_LT(3 * left, 2 * all);
}

TEST(SimplifyTerrain, RemovesNoiseAndKeepsAStep) {
  Random random(5);
  std::normal_distribution<double> noise(0, 0.02);
  MeasuredMesh mesh{random_terrain(60, 0, 0, 0, random)};
  for (glm::dvec3& p : mesh.shape.vertices_m)
    p.z = std::clamp(noise(random), -0.05, 0.05) + (p.x < 30 ? 0 : 0.5);
  mesh.sd_m.assign(mesh.shape.vertices_m.size(), 0.02f);
  const Simplified result = simplify(mesh, NoiseBound{.sds = 3});
  EXPECT_LT(result.mesh.shape.triangles.size(), 200u);
  EXPECT_LE(testing::check_plan(mesh.shape.vertices_m, result.mesh.shape).largest_m, 0.06 + 1e-9);
  EXPECT_EQ(result.mesh.sd_m.size(), result.mesh.shape.vertices_m.size());
}

TEST(SimplifyTerrain, BoundsEachVertexByItsOwnNoise) {
  Random random(6);
  MeasuredMesh mesh{random_terrain(50, 0, 0.1, 0, random)};
  for (const glm::dvec3& p : mesh.shape.vertices_m)
    mesh.sd_m.push_back(static_cast<float>(p.x < 25 ? 0.001 : 0.2));
  const Simplified result = simplify(mesh, NoiseBound{.sds = 2});
  std::vector<glm::dvec3> exact, vague;
  for (const glm::dvec3& p : mesh.shape.vertices_m) (p.x < 25 ? exact : vague).push_back(p);
  EXPECT_LE(testing::check_plan(exact, result.mesh.shape).largest_m, 0.002 + 1e-9);
  EXPECT_LE(testing::check_plan(vague, result.mesh.shape).largest_m, 0.4 + 1e-9);
  EXPECT_LT(result.mesh.shape.triangles.size(), mesh.shape.triangles.size() * 6 / 10);
}

// Heights are multiples of 1/64 m and the shift is whole metres: positions are exact doubles
// wherever the mesh is.
TEST(SimplifyTerrain, DoesNotDependOnTheOrigin) {
  Random random(7);
  TriangleMesh mesh = random_terrain(50, 0, 0.3, 5, random);
  for (glm::dvec3& p : mesh.vertices_m) p.z = std::round(64 * p.z) / 64;
  TriangleMesh away = mesh;
  const glm::dvec3 by(512'345, 5'412'345, 1'234);
  for (glm::dvec3& p : away.vertices_m) p += by;
  const VerticalBound bound{.error_m = 0.4, .border_m = 0.5};
  const Simplified here = simplify({mesh}, bound), there = simplify({away}, bound);
  EXPECT_EQ(here.mesh.shape.triangles, there.mesh.shape.triangles);
  EXPECT_EQ(here.sources, there.sources);
  for (std::size_t i = 0; i < there.sources.size(); ++i)
    EXPECT_EQ(there.mesh.shape.vertices_m[i], away.vertices_m[there.sources[i]]);
}

TEST(SimplifyTerrain, LabelBoundariesStayInPlace) {
  Random random(8);
  MeasuredMesh mesh{random_terrain(60, 0.1, 0.02, 0, random)};
  const auto label_at = [](const glm::dvec3& p) {
    return static_cast<std::uint16_t>(p.x + 4 * std::sin(0.15 * p.y) < 30 ? 3 : 7);
  };
  for (const glm::dvec3& p : mesh.shape.vertices_m) mesh.labels.push_back(label_at(p));
  const std::size_t odd_one = 61 * 30 + 45;
  mesh.labels[odd_one] = 11;
  const double border_m = 0.5;
  const Simplified result = simplify(mesh, VerticalBound{.error_m = 2, .border_m = border_m});
  const MeasuredMesh& coarse = result.mesh;
  EXPECT_LT(coarse.shape.triangles.size(), mesh.shape.triangles.size() / 10);
  EXPECT_EQ(std::count(coarse.labels.begin(), coarse.labels.end(), 11), 1);
  // Farther from label changes than a cell plus the bound, all corners have the label of their
  // position.
  for (std::size_t i = 0; i < mesh.labels.size(); ++i) {
    const glm::dvec3& p = mesh.shape.vertices_m[i];
    bool is_amid = glm::length(p - mesh.shape.vertices_m[odd_one]) > 3;
    for (double angle = 0; angle < 6.3; angle += 0.5)
      is_amid = is_amid &&
                label_at(p + 2.2 * glm::dvec3(std::cos(angle), std::sin(angle), 0)) == label_at(p);
    if (!is_amid) continue;
    bool is_alike = false;  // true if a triangle there has the label
    for (std::size_t k = 0; k < coarse.shape.triangles.size() && !is_alike; ++k) {
      if (!testing::height_at(coarse.shape, k, glm::dvec2(p))) continue;
      const glm::uvec3& t = coarse.shape.triangles[k];
      is_alike = coarse.labels[t.x] == mesh.labels[i] && coarse.labels[t.y] == mesh.labels[i] &&
                 coarse.labels[t.z] == mesh.labels[i];
    }
    EXPECT_TRUE(is_alike || testing::check_plan({p}, coarse.shape).uncovered == 1)
        << p.x << ' ' << p.y;
  }
  SimplifyOptions ignoring;
  ignoring.labels = LabelBorders::Ignore;
  EXPECT_LT(simplify(mesh, VerticalBound{.error_m = 2, .border_m = border_m}, ignoring)
                .mesh.shape.triangles.size(),
            coarse.shape.triangles.size());
}

}  // namespace
}  // namespace groundray::simplify_terrain_test
