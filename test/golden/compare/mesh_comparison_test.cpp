#include "apps/golden/compare/mesh_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>
#include <string>

#include "apps/golden/compare/mesh_clip.h"
#include "core/error.h"
#include "core/io/mesh_io.h"
#include "test/support/scans/solid.h"
#include "test/support/temporary_folder.h"

namespace groundray::golden::mesh_comparison_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::TemporaryFolder;

double value_of(const Section& section, const std::string& name) {
  for (const Measure& measure : section.measures) {
    if (measure.name == name) return measure.value;
  }
  ADD_FAILURE() << "there is no measure '" << name << "'";
  return std::nan("");
}

TriangleMesh moved(TriangleMesh mesh, const glm::dvec3& by_m) {
  for (glm::dvec3& p : mesh.vertices_m) p += by_m;
  return mesh;
}

// A cube of side 2 m inside one of 2.5 m: 0.25 m from face to face, and 0.25 sqrt(3) m from the
// outer corners to the inner ones.
TEST(MeshComparison, MatchesClosedFormsForNestedCubes) {
  const TriangleMesh inner = testing::box_model({2, 2, 2}).mesh;
  const TriangleMesh outer = testing::box_model({2.5, 2.5, 2.5}).mesh;
  const Section section = compare_meshes(inner, outer, "cubes");
  const double corner_m = 0.25 * std::sqrt(3.0);
  constexpr double tolerance_m = 1e-6 * 3.5;  // relative to the inner diagonal, 2 sqrt(3) m
  EXPECT_LE(value_of(section, "Hausdorff distance, at least"), corner_m);
  EXPECT_GE(value_of(section, "Hausdorff distance, at most"), corner_m);
  EXPECT_NEAR(value_of(section, "Hausdorff distance, at most"), corner_m, tolerance_m);
  EXPECT_NEAR(value_of(section, "reference to other: largest distance, at most"), 0.25, 1e-5);
  EXPECT_NEAR(value_of(section, "reference to other: mean distance"), 0.25, 1e-9);
  EXPECT_NEAR(value_of(section, "reference to other: RMS distance"), 0.25, 1e-9);
  EXPECT_GT(value_of(section, "other to reference: RMS distance"), 0.25);
  EXPECT_NEAR(value_of(section, "reference to other: mean angle between normals"), 0, 1e-9);
  EXPECT_NEAR(value_of(section, "reference: area"), 24, 1e-9);
  EXPECT_NEAR(value_of(section, "other: area"), 37.5, 1e-9);
  EXPECT_EQ(value_of(section, "other: triangles"), 12);
  EXPECT_EQ(section.verdict, Verdict::Told);
}

// On an outer face of side 2.5 m, a square of side 2 m is 0.25 m from the inner cube; the strips
// round it are up to 0.25 m beyond that square's edges. All of the inner cube is 0.25 m from the
// outer.
TEST(MeshComparison, ReportsPrecisionAndCompletenessWithinTolerances) {
  const TriangleMesh inner = testing::box_model({2, 2, 2}).mesh;
  const TriangleMesh outer = testing::box_model({2.5, 2.5, 2.5}).mesh;
  const Section section =
      compare_meshes(inner, outer, "cubes", {.step_m = 0.02, .within_m = {0.2, 0.26, 0.5}});
  EXPECT_EQ(value_of(section, "precision within 0.2 m"), 0);
  EXPECT_EQ(value_of(section, "completeness within 0.2 m"), 0);
  EXPECT_EQ(value_of(section, "F1 within 0.2 m"), 0);
  // Points within 0.26 m are at most r = sqrt(0.26^2 - 0.25^2) outside the square.
  const double r = std::sqrt(0.26 * 0.26 - 0.25 * 0.25);
  const double share = (4 + 8 * r + std::numbers::pi * r * r) / 6.25;
  EXPECT_NEAR(value_of(section, "precision within 0.26 m"), 100 * share, 0.2);
  EXPECT_LE(value_of(section, "precision within 0.26 m, at least"), 100 * share);
  EXPECT_GE(value_of(section, "precision within 0.26 m, at most"), 100 * share);
  EXPECT_EQ(value_of(section, "completeness within 0.26 m"), 100);
  EXPECT_NEAR(value_of(section, "F1 within 0.26 m"), 100 * 2 * share / (1 + share), 0.2);
  EXPECT_EQ(value_of(section, "F1 within 0.5 m"), 100);
  EXPECT_EQ(value_of(section, "reference to other: angle between normals, 99 % of the area up to"),
            0);
}

TEST(MeshComparison, ReportsTheDistributionAndTheLargestDistances) {
  const TriangleMesh ball = testing::icosphere(1, 3).mesh;
  TriangleMesh dented = ball;
  dented.vertices_m[5] *= 1.2;
  const Section section = compare_meshes(ball, dented, "a dent");
  ASSERT_EQ(section.histograms.size(), 2u);
  for (const Histogram& histogram : section.histograms) {
    const auto whole = std::accumulate(histogram.counts.begin(), histogram.counts.end(),
                                       histogram.below + histogram.above);
    EXPECT_NEAR(static_cast<double>(whole), 1e6, 60);  // the count of each bin is rounded
    EXPECT_GT(histogram.counts[0], 900'000u);
  }
  ASSERT_EQ(section.tables.size(), 2u);
  const auto& first = section.tables[0].rows.at(0);
  const glm::dvec3 peak = dented.vertices_m[5];
  EXPECT_NEAR(std::stod(first[1]), peak.x, 1e-3);
  EXPECT_NEAR(std::stod(first[2]), peak.y, 1e-3);
  EXPECT_NEAR(std::stod(first[3]), peak.z, 1e-3);
  EXPECT_NEAR(std::stod(first[4]), 0.2, 1e-3);
}

/// A rectangle of two triangles at a height, from (0, 0) to (x, y).
TriangleMesh sheet(double x_m, double y_m, double z_m) {
  return {{{0, 0, z_m}, {x_m, 0, z_m}, {x_m, y_m, z_m}, {0, y_m, z_m}}, {{0, 1, 2}, {0, 2, 3}}, {}};
}

double area_m2(const TriangleMesh& mesh) {
  double sum = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3& a = mesh.vertices_m[t.x];
    sum += glm::length(glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a)) / 2;
  }
  return sum;
}

Scope box(const glm::dvec3& low_m, const glm::dvec3& high_m) {
  return {.low_m = low_m, .high_m = high_m};
}

constexpr double far = Scope::unbounded;

// A reference of 10 m x 10 m, and 0.1 m above it a mesh that covers only its first 6 m: without a
// scope, the reference's edge is 4 m from the mesh's. A box restricts the surface from which
// distances are measured, not the surface to which: at x = 8 m the mesh's edge is 2 m away.
TEST(MeshComparison, MeasuresDistancesWithinABox) {
  const TriangleMesh reference = sheet(10, 10, 0), other = sheet(6, 10, 0.1);
  const auto largest_m = [&](const Scope& scope) {
    const Section section = compare_meshes(reference, other, "sheets", {.step_m = 0.25}, scope);
    const double at_most_m = value_of(section, "Hausdorff distance, at most");
    EXPECT_NEAR(value_of(section, "Hausdorff distance, at least"), at_most_m, 2e-5);
    return at_most_m;
  };
  constexpr double tolerance_m = 2e-5;  // 1e-6 of the diagonal, with rounding
  EXPECT_NEAR(largest_m({}), std::hypot(4, 0.1), tolerance_m);
  EXPECT_NEAR(largest_m(box({-far, -far, -far}, {8, far, far})), std::hypot(2, 0.1), tolerance_m);
  for (const double end_m : {5.0, 6.0}) {
    const Scope scope = box({0.5, 1, -1}, {end_m, 9, 1});
    EXPECT_NEAR(largest_m(scope), 0.1, tolerance_m);
    const Section section = compare_meshes(reference, other, "sheets", {.step_m = 0.25}, scope);
    for (const char* way : {"other to reference", "reference to other"})
      EXPECT_NEAR(value_of(section, std::string(way) + ": RMS distance"), 0.1, 1e-9);
    for (const char* area : {"reference: area", "other: area"})
      EXPECT_NEAR(value_of(section, area), (end_m - 0.5) * 8, 1e-9);
    EXPECT_THAT(section.text, HasSubstr("Only x from 0.5 to"));
  }
}

// With a limit of 0.5 m, the reference counts up to t = sqrt(0.5^2 - 0.1^2) beyond the mesh's edge.
// At s beyond it, the distance is sqrt(0.1^2 + s^2).
TEST(MeshComparison, LeavesOutWhatIsFartherThanALimit) {
  const TriangleMesh reference = sheet(10, 10, 0), other = sheet(6, 10, 0.1);
  constexpr double limit_m = 0.5, step_m = 0.02;
  const Section section =
      compare_meshes(reference, other, "sheets", {.step_m = step_m, .within_m = {0.2}},
                     {.ignore_beyond_m = limit_m});
  const double t = std::sqrt(limit_m * limit_m - 0.01);
  const std::string left_out = ": left out, farther than 0.5 m from the other surface";
  // Parts with edges of one step are left out as a whole.
  EXPECT_NEAR(value_of(section, "reference" + left_out), 10 * (4 - t), 10 * step_m);
  EXPECT_NEAR(value_of(section, "reference" + left_out + ", share"), 10 * (4 - t), 10 * step_m);
  EXPECT_EQ(value_of(section, "other" + left_out), 0);
  EXPECT_NEAR(value_of(section, "reference to other: RMS distance"),
              std::sqrt((0.01 * (6 + t) + t * t * t / 3) / (6 + t)), 1e-3);
  EXPECT_NEAR(value_of(section, "other to reference: RMS distance"), 0.1, 1e-9);
  EXPECT_LE(value_of(section, "Hausdorff distance, at least"), limit_m);
  EXPECT_NEAR(value_of(section, "Hausdorff distance, at most"), limit_m, 2 * step_m);
  const double completeness = 100 * (6 + std::sqrt(0.04 - 0.01)) / (6 + t);
  EXPECT_NEAR(value_of(section, "completeness within 0.2 m"), completeness, 0.1);
  EXPECT_LE(value_of(section, "completeness within 0.2 m, at least"), completeness);
  EXPECT_GE(value_of(section, "completeness within 0.2 m, at most"), completeness);
  EXPECT_EQ(value_of(section, "precision within 0.2 m"), 100);
  EXPECT_NEAR(value_of(section, "reference to other: 50 % of the area within"), 0.1, 1e-3);
  EXPECT_NEAR(value_of(section, "reference to other: 99 % of the area within"),
              std::hypot(0.1, 6.49 * 0.99 - 6), 0.01);
}

TEST(MeshComparison, RejectsScopesWithoutASurface) {
  const TriangleMesh reference = sheet(10, 10, 0), other = sheet(6, 10, 0.1);
  const auto message = [&](const Scope& scope) -> std::string {
    try {
      compare_meshes(reference, other, "sheets", {}, scope);
    } catch (const Error& error) {
      return error.what();
    }
    return "no Error was thrown";
  };
  EXPECT_THAT(message(box({7, 0, -1}, {8, 10, 1})),
              HasSubstr("other: no part of it is within the area and heights; in their frame it "
                        "reaches from (0, 0, 0.1) to (6, 10, 0.1) m"));
  EXPECT_THAT(message({.ignore_beyond_m = 0.05}),
              HasSubstr("other: all of it is farther than 0.05 m from the other mesh"));
  EXPECT_THAT(message(box({5, 0, 0}, {1, 1, 1})), HasSubstr("must be W S E N, metres, with W < E"));
  EXPECT_THAT(message(box({0, 0, 2}, {1, 1, 1})), HasSubstr("must be LOW HIGH, metres"));
  EXPECT_THAT(message({.ignore_beyond_m = -1}), HasSubstr("-1 m, must be positive"));
  EXPECT_THAT(message({.ignore_beyond_m = std::nan("")}), HasSubstr("must be positive"));
}

// A cube of side 2 m without what is above z = 0.5: the bottom, and four sides of 2 m x 1.5 m.
TEST(MeshClip, CutsTriangles) {
  const TriangleMesh cube = testing::box_model({2, 2, 2}).mesh;
  EXPECT_NEAR(area_m2(clipped(cube, box({-far, -far, -far}, {far, far, 0.5})).mesh), 16, 1e-12);
  EXPECT_NEAR(area_m2(clipped(cube, box({-5, -5, -5}, {5, 5, 5})).mesh), 24, 1e-12);
  EXPECT_TRUE(clipped(cube, box({2, -far, -far}, {3, far, far})).mesh.triangles.empty());
}

// Any plane divides a sphere's facets into two parts with the same area in total, and each part's
// triangles lie in the planes of their facets.
TEST(MeshClip, KeepsAreasAndPlanes) {
  const TriangleMesh ball = testing::icosphere(1, 3).mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double at_m : {-0.7, -0.1234, 0.0, 0.5, 0.99}) {
      glm::dvec3 low_m(-far), high_m(far);
      low_m[axis] = high_m[axis] = at_m;
      const MeshPart below = clipped(ball, box(glm::dvec3(-far), high_m));
      const MeshPart above = clipped(ball, box(low_m, glm::dvec3(far)));
      EXPECT_NEAR(area_m2(below.mesh) + area_m2(above.mesh), area_m2(ball), 1e-12);
      for (std::size_t t = 0; t < below.mesh.triangles.size(); ++t) {
        const glm::uvec3 whole = ball.triangles[below.triangle_of[t]];
        const glm::dvec3 a = ball.vertices_m[whole.x];
        const glm::dvec3 normal =
            glm::cross(ball.vertices_m[whole.y] - a, ball.vertices_m[whole.z] - a);
        for (int k = 0; k < 3; ++k) {
          const glm::dvec3 p = below.mesh.vertices_m[below.mesh.triangles[t][k]];
          EXPECT_LE(p[axis], at_m);
          EXPECT_NEAR(glm::dot(glm::normalize(normal), p - a), 0, 1e-15);
        }
      }
    }
  }
}

class MeshFiles : public ::testing::Test {
 protected:
  std::filesystem::path put(const std::string& name, const TriangleMesh& mesh,
                            const Georeference& georeference) const {
    write_mesh(folder_ / name, mesh, georeference);
    return folder_ / name;
  }
  TemporaryFolder folder_;
};

TEST_F(MeshFiles, AreComparedInWorldCoordinates) {
  const TriangleMesh ball = testing::icosphere(10, 2).mesh;
  const auto here = put("a.ply", ball, {{435000, 5150500, 0}, "UTM 15N", ""});
  const auto there =
      put("b.glb", moved(ball, {-100, 20, 3}), {{435100, 5150480, -3}, "UTM 15N", ""});
  const Section same = compare_meshes(here, there);
  // glTF stores floats: below 128 m they are off by up to half an ulp, 2^-18 m, along each axis.
  EXPECT_LT(value_of(same, "Hausdorff distance, at most"), 2e-5);
  EXPECT_THAT(same.title, HasSubstr("b.glb against "));
  const auto silent = put("c.obj", ball, {});
  const Section taken = compare_meshes(here, silent);
  EXPECT_LT(value_of(taken, "Hausdorff distance, at most"), 1e-9 + 1e-6 * 35);
  EXPECT_THAT(taken.text, HasSubstr("other has no georeference"));
  const auto elsewhere = put("d.ply", ball, {{435000, 5150500, 0}, "UTM 16N", ""});
  try {
    compare_meshes(here, elsewhere);
    ADD_FAILURE() << "no Error was thrown";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("its reference system is UTM 16N and that of"));
  }
}

// Local coordinates of other programs become comparable by the origin that the user gives, in both
// directions; a box is in W.
TEST_F(MeshFiles, WithoutAGeoreferenceAreShiftedByTheGivenOrigin) {
  const glm::dvec3 origin_w_m(435'000, 5'150'500, 200);
  const TriangleMesh ball = testing::icosphere(10, 2).mesh;
  const auto here = put("here.ply", ball, {origin_w_m, "UTM 15N", ""});
  const auto local = put("local.obj", moved(ball, {7, -8, 9}), {});
  const glm::dvec3 its_w_m = origin_w_m - glm::dvec3(7, -8, 9);
  constexpr double tolerance_m = 1e-6 * 35;  // relative to the diagonal, 20 sqrt(3) m
  const Section shifted =
      compare_meshes(here, local, {.step_m = 1}, {}, {.reference_w_m = {}, .other_w_m = its_w_m});
  EXPECT_LT(value_of(shifted, "Hausdorff distance, at most"), tolerance_m);
  EXPECT_THAT(shifted.text, Not(HasSubstr("has no georeference")));
  const Section swapped =
      compare_meshes(local, here, {.step_m = 1}, {}, {.reference_w_m = its_w_m, .other_w_m = {}});
  EXPECT_LT(value_of(swapped, "Hausdorff distance, at most"), tolerance_m);
  EXPECT_THAT(compare_meshes(here, local, {.step_m = 1}).text,
              HasSubstr("(--origin gives its origin"));
  // The upper hemisphere, by its heights in W.
  const Section upper =
      compare_meshes(here, local, {.step_m = 1}, box({-far, -far, 200}, {far, far, far}),
                     {.reference_w_m = {}, .other_w_m = its_w_m});
  EXPECT_NEAR(value_of(upper, "reference: area"), area_m2(ball) / 2, 1e-6);
  try {
    compare_meshes(here, local, {}, {}, {.reference_w_m = origin_w_m, .other_w_m = its_w_m});
    ADD_FAILURE() << "no Error was thrown";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("here.ply: the file states its origin, 435000 5150500 200"));
  }
}

TEST(MeshComparison, RejectsAMeshWithoutTriangles) {
  const TriangleMesh ball = testing::icosphere(1, 1).mesh;
  try {
    compare_meshes(ball, {}, "nothing");
    ADD_FAILURE() << "no Error was thrown";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("other: there is no triangle"));
  }
}

}  // namespace
}  // namespace groundray::golden::mesh_comparison_test
