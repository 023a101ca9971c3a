#include "reconstruction/mesh/simplify/simplify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <utility>

#include "core/error.h"
#include "test/support/scans/solid.h"
#include "test/support/terrain/plan_check.h"

namespace groundray::simplify_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using Random = std::mt19937_64;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
// Reduces the effort for the error, which these tests do not examine.
constexpr SimplifyOptions quick{.fineness = {.samples = 100, .most_pieces = 100}};

// Sheet of cells of 1 m; `place` gives the position of the vertex at each column and row.
template <typename Place>
TriangleMesh sheet(int columns, int rows, const Place& place) {
  TriangleMesh mesh;
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) mesh.vertices_m.push_back(place(column, row));
  }
  const auto side = static_cast<unsigned>(columns + 1);
  for (unsigned row = 0; row < static_cast<unsigned>(rows); ++row) {
    for (unsigned column = 0; column + 1 < side; ++column) {
      const unsigned a = row * side + column, b = a + 1, c = a + side, d = c + 1;
      mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {b, d, c}});
    }
  }
  return mesh;
}

TriangleMesh hills(int cells) {
  return sheet(cells, cells, [](int x, int y) {
    return glm::dvec3(x, y,
                      3 * std::sin(0.21 * x) * std::cos(0.17 * y) + 0.1 * ((7 * x + 3 * y) % 5));
  });
}

void expect_within(const TriangleMesh& original, const Simplified& result, double error_m) {
  const double tolerance_m = 0.1 * error_m;
  const LargestDistance forth = MeshDistance(original, result.mesh.shape).largest(tolerance_m);
  const LargestDistance back = MeshDistance(result.mesh.shape, original).largest(tolerance_m);
  EXPECT_LE(forth.at_least_m, error_m);
  EXPECT_LE(back.at_least_m, error_m);
  EXPECT_LE(hausdorff(forth, back).at_most_m, error_m + tolerance_m);
  EXPECT_LE(result.error.largest().at_most_m, error_m);
  EXPECT_EQ(testing::manifold_faults(result.mesh.shape), 0u);
}

TEST(Simplify, APlaneBecomesTwoTrianglesInAnyOrientation) {
  const glm::dvec3 along = glm::normalize(glm::dvec3(1, 2, -3)), across(3, 0, 1);
  const TriangleMesh plane =
      sheet(25, 25, [&](int x, int y) { return 0.37 * x * along + 0.2 * y * across; });
  for (const StopCriterion& halt : {StopCriterion(DistanceBound{1e-4, 1e-9}),
                                    StopCriterion(CostKnee{}), StopCriterion(FaceBudget{2})})
    EXPECT_EQ(simplify({plane}, halt).mesh.shape.triangles.size(), 2u) << halt.index();
}

TEST(Simplify, ARidgeKeepsItsCrease) {
  const TriangleMesh roof =
      sheet(30, 20, [](int x, int y) { return glm::dvec3(x, y, 10 - std::abs(x - 15)); });
  for (const StopCriterion& halt :
       {StopCriterion(VerticalBound{1e-6, 0}), StopCriterion(DistanceBound{1e-6, 0}),
        StopCriterion(CostKnee{})}) {
    const Simplified result = simplify({roof}, halt);
    EXPECT_EQ(result.mesh.shape.triangles.size(), 4u);
    EXPECT_LE(testing::check_plan(roof.vertices_m, result.mesh.shape).largest_m, 1e-9);
  }
  // A bound that would permit cutting the ridge does not move a crease.
  const Simplified coarse = simplify({roof}, VerticalBound{.error_m = 2}, {.crease_rad = 1});
  const Simplified cut = simplify({roof}, VerticalBound{.error_m = 30}, {.crease_rad = 2});
  EXPECT_EQ(coarse.mesh.shape.triangles.size(), 4u);
  EXPECT_EQ(cut.mesh.shape.triangles.size(), 2u);
}

TEST(Simplify, APyramidKeepsItsTipAndFoot) {
  const TriangleMesh pyramid = sheet(40, 40, [](int x, int y) {
    return glm::dvec3(x, y, std::max(0, 10 - std::max(std::abs(x - 20), std::abs(y - 20))));
  });
  const Simplified result = simplify({pyramid}, DistanceBound{.error_m = 1e-4});
  // The diagonals of cells turn two of the four edges into steps, which stay.
  EXPECT_LE(testing::check_plan(pyramid.vertices_m, result.mesh.shape).largest_m, 2e-4);
  EXPECT_LT(result.mesh.shape.triangles.size(), 150u);
  expect_within(pyramid, result, 1e-4);
}

// A polygon of n sides inscribed in a circle is r (1 - cos(pi / n)) from it, and a tube of n sides
// has 2 n triangles. Simplification onto existing vertices needs some more.
TEST(Simplify, ATubeNeedsLittleMoreThanTheFewestTriangles) {
  const int around = 120;
  TriangleMesh tube = sheet(around, 15, [&](int column, int row) {
    const double angle = 2 * std::numbers::pi * column / around;
    return glm::dvec3(5 * std::cos(angle), 5 * std::sin(angle), row);
  });
  for (glm::uvec3& t : tube.triangles) {  // the last column coincides with the first
    for (int k = 0; k < 3; ++k) {
      if (t[k] % 121 == 120) t[k] -= 120;
    }
  }
  for (const double error_m : {0.05, 0.1, 0.5}) {
    const Simplified result = simplify({tube}, DistanceBound{error_m, error_m});
    const double least = 2 * std::numbers::pi / std::acos(1 - error_m / 5);
    const auto found = static_cast<double>(result.mesh.shape.triangles.size());
    EXPECT_GE(found, std::floor(least) - 4);
    EXPECT_LE(found, 3 * least);
    expect_within(tube, result, error_m);
  }
}

TEST(Simplify, ABallIsWithinTheBoundInBothDirections) {
  const TriangleMesh ball = testing::icosphere(2, 4).mesh;
  std::size_t before = ball.triangles.size();
  for (const double error_m : {0.02, 0.1}) {
    const Simplified result = simplify({ball}, DistanceBound{.error_m = error_m});
    expect_within(ball, result, error_m);
    EXPECT_LT(result.mesh.shape.triangles.size(), before * 2 / 3);
    EXPECT_TRUE(testing::border_of(result.mesh.shape).empty());
    before = result.mesh.shape.triangles.size();
  }
}

// Overhanging ground with creases of any kind.
TEST(Simplify, RoughSurfacesAreWithinTheBoundInBothDirections) {
  Random random(11);
  std::uniform_real_distribution<double> noise(-0.15, 0.15);
  for (const double error_m : {0.1, 0.4}) {
    const TriangleMesh folded = sheet(30, 24, [&](int x, int y) {
      const double angle = 0.25 * x;
      return glm::dvec3(0.6 * x + 4 * std::sin(angle), y, 4 * std::cos(angle)) +
             glm::dvec3(noise(random), noise(random), noise(random));
    });
    const Simplified result = simplify({folded}, DistanceBound{error_m, error_m});
    expect_within(folded, result, error_m);
    EXPECT_EQ(result.rounds, 1u);
    EXPECT_FALSE(result.vertical);
    EXPECT_LT(result.mesh.shape.triangles.size(), folded.triangles.size());
  }
}

TEST(Simplify, ABudgetIsReached) {
  MeasuredMesh mesh{hills(40)};
  mesh.confidence.assign(mesh.shape.vertices_m.size(), 0.5f);
  for (const std::size_t budget : {1000u, 300u}) {
    const Simplified result = simplify(mesh, FaceBudget{budget});
    EXPECT_EQ(result.halted_by, HaltReason::Budget);
    EXPECT_LE(result.mesh.shape.triangles.size(), budget);
    EXPECT_GE(result.mesh.shape.triangles.size() + 1, budget);
    EXPECT_EQ(result.mesh.confidence.size(), result.mesh.shape.vertices_m.size());
    EXPECT_GT(result.error.rms_m(), 0);
  }
  for (const glm::dvec3& p : mesh.shape.vertices_m) mesh.labels.push_back(p.x < 20 ? 1 : 2);
  for (const std::size_t budget : {1000u, 300u}) {
    const Simplified labelled = simplify(mesh, FaceBudget{budget});
    EXPECT_EQ(labelled.halted_by, HaltReason::Budget);
    EXPECT_LE(labelled.mesh.shape.triangles.size(), budget);
    EXPECT_GE(labelled.mesh.shape.triangles.size() + 1, budget);
    for (std::size_t i = 0; i < labelled.sources.size(); ++i)
      EXPECT_EQ(labelled.mesh.labels[i], labelled.mesh.shape.vertices_m[i].x < 20 ? 1 : 2);
  }
}

// Four slopes in one plane each, roughened by far less than they differ: the roughness is removed,
// the shape of the slopes remains.
TEST(Simplify, TheKneeIsBetweenRoughnessAndShape) {
  Random random(12);
  std::normal_distribution<double> noise(0, 1e-3);
  const TriangleMesh mesh = sheet(48, 48, [&](int x, int y) {
    return glm::dvec3(x, y, 8 - std::abs(x - 24) / 3. - std::abs(y - 24) / 4. + noise(random));
  });
  const Simplified result = simplify({mesh}, CostKnee{}, {.crease_rad = std::numbers::pi});
  EXPECT_EQ(result.halted_by, HaltReason::Knee);
  EXPECT_LT(result.mesh.shape.triangles.size(), 400u);
  EXPECT_LE(testing::check_plan(mesh.vertices_m, result.mesh.shape).largest_m, 0.05);
}

TEST(Simplify, RemovesNoiseFromClosedSurfaces) {
  Random random(13);
  std::uniform_real_distribution<double> noise(-0.01, 0.01);
  MeasuredMesh ball{testing::icosphere(2, 4).mesh};
  for (glm::dvec3& p : ball.shape.vertices_m) p *= 1 + noise(random);
  ball.sd_m.assign(ball.shape.vertices_m.size(), 0.02f);
  const Simplified result = simplify(ball, NoiseBound{.sds = 2});
  EXPECT_LT(result.mesh.shape.triangles.size(), ball.shape.triangles.size() / 5);
  const ClosestPoint surface(result.mesh.shape);
  for (const glm::dvec3& p : ball.shape.vertices_m)
    EXPECT_LE(surface.nearest(p).distance_m, 0.04 * (1 + 1e-6));
}

// For any number of threads, and when repeated.
TEST(Simplify, SameMeshForAnyNumberOfThreadsAndAgain) {
  const MeasuredMesh mesh{hills(30)};
  for (const StopCriterion& halt :
       {StopCriterion(VerticalBound{0.1, 0}), StopCriterion(DistanceBound{0.1, 0.1}),
        StopCriterion(CostKnee{}), StopCriterion(FaceBudget{500})}) {
    std::vector<Simplified> results;
    for (const std::size_t threads : {1u, 3u}) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      results.push_back(simplify(mesh, halt));
    }
    EXPECT_EQ(results[0].mesh.shape.triangles, results[1].mesh.shape.triangles);
    EXPECT_EQ(results[0].mesh.shape.vertices_m, results[1].mesh.shape.vertices_m);
    EXPECT_EQ(results[0].error.rms_m(), results[1].error.rms_m());
    EXPECT_EQ(results[0].error.largest().at_most_m, results[1].error.largest().at_most_m);
  }
}

TEST(Simplify, ReportsProgressAndStopsOnRequest) {
  struct Stop {};
  const MeasuredMesh mesh{hills(40)};
  for (const StopCriterion& halt :
       {StopCriterion(VerticalBound{0.5, 0}), StopCriterion(DistanceBound{0.2, 0.1}),
        StopCriterion(CostKnee{}), StopCriterion(FaceBudget{500})}) {
    std::vector<double> shares;
    simplify(mesh, halt, quick, {.progress = [&](double share) { shares.push_back(share); }});
    EXPECT_GE(shares.size(), 2u);
    EXPECT_EQ(shares.back(), 1);
    EXPECT_TRUE(std::all_of(shares.begin(), shares.end(),
                            [](double share) { return share >= 0 && share <= 1; }));
    EXPECT_THROW(simplify(mesh, halt, quick, {.progress = [](double) { throw Stop(); }}), Stop);
  }
}

template <typename RunControl>
std::string message_of(const RunControl& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Simplify, RejectsInvalidInput) {
  const TriangleMesh good = hills(4);
  const auto fault = [&](const MeasuredMesh& mesh, const StopCriterion& halt,
                         const SimplifyOptions& options = {}, const RunControl& work = {}) {
    return message_of([&] { simplify(mesh, halt, options, work); });
  };
  EXPECT_THAT(fault({}, FaceBudget{10}), HasSubstr("mesh to simplify"));
  TriangleMesh holed = good;
  holed.vertices_m[3].z = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(fault({holed}, VerticalBound{1, 0}), HasSubstr("vertex 3"));
  EXPECT_THAT(fault({good}, VerticalBound{0, -1}),
              AllOf(HasSubstr("error_m = 0 must be positive"),
                    HasSubstr("border_m = -1 must not be negative")));
  EXPECT_THAT(fault({good}, DistanceBound{nan, 0}), HasSubstr("error_m = nan"));
  EXPECT_THAT(fault({good}, FaceBudget{0}), HasSubstr("at least 1"));
  EXPECT_THAT(fault({good}, NoiseBound{2}), HasSubstr("no standard deviations"));
  EXPECT_THAT(fault({good, {1.0f}}, NoiseBound{2}), HasSubstr("sd_m has 1 values"));
  EXPECT_THAT(fault({good, std::vector<float>(25, nan)}, NoiseBound{2}),
              HasSubstr("sd_m of vertex 0 is nan"));
  EXPECT_THAT(fault({good, {}, {1, 2}}, CostKnee{}), HasSubstr("labels has 2 values"));
  EXPECT_THAT(fault({good}, CostKnee{}, {.crease_rad = 0}), HasSubstr("crease_rad = 0"));
  EXPECT_THAT(fault({good}, CostKnee{}, {.fineness = {.samples = -1}}),
              HasSubstr("fineness.samples = -1"));
  EXPECT_THAT(fault({good}, CostKnee{}, {.fineness = {.largest_share = 1}}),
              HasSubstr("fineness.largest_share = 1"));
  TriangleMesh needles = good;
  for (glm::dvec3& p_m : needles.vertices_m) p_m.y = p_m.z = 0;
  EXPECT_THAT(fault({needles}, DistanceBound{1, 1}), HasSubstr("of the mesh are degenerate"));
  EXPECT_THAT(fault({good}, CostKnee{}, {}, {.most_bytes = 1000}), HasSubstr("32 triangles take"));
  TriangleMesh over = good;
  std::swap(over.triangles[5].x, over.triangles[5].y);
  EXPECT_THAT(fault({over}, VerticalBound{1, 0}),
              AllOf(HasSubstr("triangle 5"), HasSubstr("overhangs"), HasSubstr("any direction")));
  const TriangleMesh line = sheet(4, 4, [](int x, int y) { return glm::dvec3(x + y, 0, 0); });
  EXPECT_THAT(fault({line}, DistanceBound{1, 0}), HasSubstr("degenerate"));
  TriangleMesh points = good;
  for (glm::uvec3& t : points.triangles) t.y = t.x;
  EXPECT_THAT(fault({points}, CostKnee{}), HasSubstr("there is no surface"));
}

// Pages of a book, sheets that touch at a vertex, and repeated triangles.
TEST(Simplify, CutsAndCountsNonManifoldParts) {
  TriangleMesh book;
  for (unsigned page = 0; page < 3; ++page) {
    const TriangleMesh leaf = sheet(10, 10, [&](int x, int y) {
      const double angle = 2. * page;
      return glm::dvec3(x * std::cos(angle), x * std::sin(angle), y);
    });
    for (const glm::uvec3& t : leaf.triangles) {
      glm::uvec3 moved;
      for (int k = 0; k < 3; ++k) moved[k] = t[k] % 11 == 0 ? t[k] : t[k] + 121 * page;
      book.triangles.push_back(moved);
    }
    book.vertices_m.insert(book.vertices_m.end(), leaf.vertices_m.begin(), leaf.vertices_m.end());
  }
  book.triangles.push_back(book.triangles.front());
  book.triangles.emplace_back(5, 5, 7);
  const Simplified result = simplify({book}, DistanceBound{1e-6, 0});
  EXPECT_EQ(result.repairs.dropped_triangles, 2u);
  EXPECT_EQ(result.repairs.cut_edges, 10u);
  EXPECT_EQ(result.repairs.unused_vertices, 22u);
  EXPECT_EQ(result.repairs.parted_vertices, 22u);
  EXPECT_EQ(result.mesh.shape.triangles.size(), 6u);
  expect_within(book, result, 1e-6);
}

TEST(Simplify, MakesASurfaceOfAnyTriangles) {
  Random random(14);
  for (int i = 0; i < 40; ++i) {
    TriangleMesh mesh;
    std::uniform_real_distribution<double> place(-1, 1);
    for (int k = 0; k < 12; ++k)
      mesh.vertices_m.emplace_back(place(random), place(random), place(random));
    if (i % 4 == 1) std::fill(mesh.vertices_m.begin(), mesh.vertices_m.begin() + 6, glm::dvec3(0));
    for (int k = 0; k < 5 + i; ++k)
      mesh.triangles.emplace_back(random() % 12, random() % 12, random() % 12);
    mesh.triangles.emplace_back(0, 6, 7);
    MeasuredMesh measured{mesh, std::vector<float>(12, 0.2f)};
    for (int k = 0; k < 12; ++k)
      measured.labels.push_back(static_cast<std::uint16_t>(k % (1 + i % 3)));
    for (const StopCriterion& halt :
         {StopCriterion(DistanceBound{0.3, 0.3}), StopCriterion(FaceBudget{4}),
          StopCriterion(NoiseBound{2}), StopCriterion(CostKnee{})}) {
      const Simplified result = simplify(measured, halt, quick);
      EXPECT_EQ(testing::manifold_faults(result.mesh.shape), 0u);
      EXPECT_FALSE(result.mesh.shape.triangles.empty());
      EXPECT_EQ(result.mesh.labels.size(), result.mesh.shape.vertices_m.size());
    }
  }
}

TEST(Simplify, SmallestMeshesStayUnchanged) {
  const TriangleMesh one{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}};
  const TriangleMesh tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                 {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}},
                                 {}};
  for (const StopCriterion& halt :
       {StopCriterion(DistanceBound{10, 10}), StopCriterion(CostKnee{})}) {
    EXPECT_EQ(simplify({one}, halt).mesh.shape.triangles, one.triangles);
    EXPECT_EQ(simplify({tetrahedron}, halt).mesh.shape.triangles, tetrahedron.triangles);
  }
  EXPECT_EQ(simplify({one}, VerticalBound{10, 10}).mesh.shape.triangles, one.triangles);
}

}  // namespace
}  // namespace groundray::simplify_test
