#include "apps/golden/compare/mesh_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <numeric>
#include <string>

#include "core/error.h"
#include "core/io/mesh_io.h"
#include "test/support/scans/solid.h"
#include "test/support/temporary_folder.h"

namespace groundray::golden::mesh_comparison_test {
namespace {

using ::testing::HasSubstr;
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
