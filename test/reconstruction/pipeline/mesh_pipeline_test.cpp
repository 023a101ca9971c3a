#include "reconstruction/pipeline/mesh_pipeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "test/support/scans/beam_fan.h"
#include "test/support/scans/linked_scan.h"

namespace groundray::mesh_pipeline_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

constexpr double eye_height_m = 2;
const BeamFan fan{.rings = 16,
                  .lowest_rad = -60 * degree,
                  .highest_rad = -20 * degree,
                  .columns = 120,
                  .columns_per_turn = 120};

// Scan of level ground at height 0; of the azimuths in a gap, some elevations return nothing.
ScanMesh ground_from(double x_m, bool has_gap = false) {
  const RangeOf ground = [&](const glm::dvec3& towards) {
    const bool is_gap = towards.x > 0.6 && std::abs(towards.y) < 0.15;
    if (has_gap && is_gap && towards.z < -0.5) return std::numeric_limits<double>::infinity();
    return -eye_height_m / towards.z;
  };
  const Pose X_DS{.translation_m = {x_m, 0, eye_height_m}};
  return link(place(scan_of(fan, ground), X_DS), ScreeningLimits::ground());
}

// Area of the mesh, if all of it is level and nothing faces down.
double plan_area_m2(const TriangleMesh& mesh) {
  double area_m2 = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices_m[t.x];
    const double up = glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a).z;
    EXPECT_GE(up, 0);
    area_m2 += up / 2;
  }
  return area_m2;
}

double largest_height_m(const MeasuredMesh& mesh) {
  double most_m = 0;
  for (const glm::dvec3& p : mesh.shape.vertices_m) most_m = std::max(most_m, std::abs(p.z));
  return most_m;
}

// The ground is a plane, whatever is merged, filled and simplified; rounding is of some 10 m.
TEST(MeshPipeline, TwoScansOfAPlaneBecomeThePlaneInFewTriangles) {
  std::map<std::string, std::vector<double>> shares;
  const PipelineControl control{
      .progress = [&](const char* stage, double share) { shares[stage].push_back(share); }};
  const MeshBuildOptions options{.fill_m = 3, .stop = DistanceBound{0.001, 0.001}};
  const MeshResult result = build_mesh({ground_from(0), ground_from(1.5)}, options, control);
  EXPECT_EQ(result.merged_scans, 2U);
  EXPECT_GT(result.merged.redundant, 100U);  // most of the ground is seen twice
  EXPECT_LT(largest_height_m(result.mesh), 1e-6);
  // Both discs less their common lens; the mesh also spans the notches where their borders meet.
  const double radius_m = eye_height_m / std::tan(-fan.highest_rad), half_m = 1.5 / 2;
  const double lens_m2 = 2 * radius_m * radius_m * std::acos(half_m / radius_m) -
                         2 * half_m * std::sqrt(radius_m * radius_m - half_m * half_m);
  const double both_m2 = 360 * degree * radius_m * radius_m - lens_m2;
  EXPECT_NEAR(result.area_m2, both_m2, 0.02 * both_m2);
  ASSERT_TRUE(result.simplified);
  EXPECT_GT(result.full_triangles, 3000U);
  EXPECT_LE(result.simplified->error.largest().at_least_m, 0.001 + 1e-9);
  EXPECT_LT(3 * result.mesh.shape.triangles.size(), 2 * result.full_triangles);
  std::vector<std::string> stages;
  for (const auto& [stage, seconds] : result.seconds) stages.push_back(stage);
  EXPECT_THAT(stages, ElementsAre("merge", "fill", "simplify"));
  ASSERT_THAT(shares, SizeIs(3));
  for (const auto& [stage, reported] : shares) {
    EXPECT_EQ(reported.front(), 0) << stage;
    EXPECT_EQ(reported.back(), 1) << stage;
  }
}

// A regular polygon whose corners are where the beams of a ring hit the ground.
double polygon_m2(double elevation_rad) {
  const double radius_m = eye_height_m / std::tan(-elevation_rad);
  return 0.5 * fan.columns * radius_m * radius_m * std::sin(360 * degree / fan.columns);
}

// The outermost ring bounds the ground. Missing returns and the blind area around the sensor are
// holes in it.
TEST(MeshPipeline, FillsTheGapsOfAPlane) {
  const MeshResult whole = build_mesh({ground_from(0)}, {});
  const double outer_m2 = polygon_m2(fan.highest_rad), inner_m2 = polygon_m2(fan.lowest_rad);
  EXPECT_NEAR(whole.area_m2, outer_m2 - inner_m2, 1e-9 * outer_m2);
  const MeshResult open = build_mesh({ground_from(0, true)}, {});
  EXPECT_LT(open.area_m2, whole.area_m2 - 0.1);
  EXPECT_FALSE(open.holes);
  const MeshResult filled = build_mesh({ground_from(0, true)}, {.fill_m = 20}),
                   later = finish_mesh(open.mesh, {.fill_m = 20});
  ASSERT_TRUE(filled.holes);
  EXPECT_THAT(filled.holes->filled, SizeIs(2));
  EXPECT_NEAR(filled.area_m2, outer_m2, 1e-6 * outer_m2);
  EXPECT_NEAR(plan_area_m2(filled.mesh.shape), outer_m2, 1e-6 * outer_m2);
  EXPECT_EQ(later.mesh.shape.vertices_m, filled.mesh.shape.vertices_m);
}

// Without standard deviations, the distance of surfaces is a share of the median edge.
TEST(MeshPipeline, DerivesTheDistanceOfSurfacesFromTheSpacing) {
  const ScanMesh scan = ground_from(0);
  std::vector<double> edges_m;
  for (const glm::uvec3& t : scan.mesh.shape.triangles)
    edges_m.push_back(
        glm::distance(scan.mesh.shape.vertices_m[t.x], scan.mesh.shape.vertices_m[t.y]));
  std::ranges::sort(edges_m);
  const MeshResult result = build_mesh({scan, scan}, {.spacing_share = 0.25});
  ASSERT_TRUE(result.spacing_m);
  EXPECT_DOUBLE_EQ(*result.spacing_m, 0.25 * edges_m[edges_m.size() / 2]);
  EXPECT_FALSE(build_mesh({scan, scan}, {.apart_m = 0.1}).spacing_m);
  ScanMesh measured = scan;
  measured.mesh.sd_m.assign(measured.mesh.shape.vertices_m.size(), 0.01F);
  EXPECT_TRUE(knows_noise(measured.mesh));
  EXPECT_FALSE(build_mesh({measured, scan}, {}).spacing_m);
}

// Ten by eight points at steps of 0.5 m span nine by seven squares.
TEST(MeshPipeline, MeshesPointsWithoutOrder) {
  UnorderedPoints points;
  for (int i = 0; i < 80; ++i) {
    const int column = i % 10, row = i / 10;
    points.points_m.emplace_back(0.5 * column, 0.5 * row, 3);
    points.origins_m.emplace_back(2, 2, 9);
    points.sd_m.push_back(0.01F * static_cast<float>(i));
    points.labels.push_back(static_cast<std::uint16_t>(i));
  }
  const MeshResult result = build_mesh(points, 2, {});
  EXPECT_NEAR(plan_area_m2(result.mesh.shape), 9 * 7 * 0.25, 1e-9);
  ASSERT_THAT(result.mesh.labels, SizeIs(80));
  for (std::size_t i = 0; i < 80; ++i) {
    const std::uint16_t source = result.mesh.labels[i];
    EXPECT_EQ(result.mesh.shape.vertices_m[i], points.points_m[source]);
    EXPECT_EQ(result.mesh.sd_m[i], points.sd_m[source]);
  }
  EXPECT_THAT(build_mesh(points, 0.1, {.fill_m = 1}).mesh.shape.triangles, IsEmpty());
}

TEST(MeshPipeline, WithoutTrianglesTheMeshIsEmpty) {
  const MeshResult result = build_mesh({ScanMesh{}, ScanMesh{}}, {.fill_m = 1, .stop = CostKnee{}});
  EXPECT_EQ(result.merged_scans, 0U);
  EXPECT_THAT(result.mesh.shape.triangles, IsEmpty());
  EXPECT_THAT(result.seconds, IsEmpty());
}

}  // namespace
}  // namespace groundray::mesh_pipeline_test
