#include "reconstruction/pipeline/terrain_decimation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "reconstruction/mesh/simplify/simplify.h"
#include "terrain/dem/dem_io.h"
#include "terrain/judge/mesh_topology.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/adversarial_terrain.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::terrain_decimation_test {
namespace {

using groundray::testing::adversarial_terrain;
using groundray::testing::fractal;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

// Checks coverage and deviation by code that shares none with what made the mesh.
void check(const HeightGrid& grid, double max_error_m) {
  const DecimatedTerrain result = decimate_terrain(grid, max_error_m);
  const TerrainMesh& mesh = result.mesh;
  EXPECT_THAT(judge::topology_faults(grid, mesh.vertices, mesh.triangles), IsEmpty());
  const judge::MeshDeviation deviation =
      judge::largest_deviation(grid, mesh.vertices, mesh.triangles);
  EXPECT_LE(deviation.largest_m, max_error_m);
  EXPECT_EQ(deviation.over_missing, 0u);
  EXPECT_EQ(deviation.largest_m, result.deviation.largest_m);
}

TEST(TerrainDecimation, KeepsBoundAndCoverageOfTerrainThatBreaksMeshers) {
  for (const auto& [name, grid] : adversarial_terrain()) {
    SCOPED_TRACE(name);
    if (build_terrain_mesh(grid, {}).triangles.empty()) continue;
    const double relief_m = std::max(grid.max_height_m() - grid.min_height_m(), 1e-3);
    for (const double share : {1e-4, 0.03, 0.4, 2.0}) check(grid, share * relief_m);
  }
}

TEST(TerrainDecimation, KeepsBoundWithManyMissingSamples) {
  const HeightGrid grid = fractal(65, 2, 40, Seed{3});
  for (const double share : {0.01, 0.1, 0.4})
    check(groundray::testing::with_missing_samples(grid, share, Seed{4}), 2);
}

// A plane of any outline without holes needs two triangles, and no edge is refused by rounding.
TEST(TerrainDecimation, MakesPlanesOfTwoTriangles) {
  std::vector<float> heights;
  for (int r = 0; r < 40; ++r) {
    for (int c = 0; c < 60; ++c)
      heights.push_back(0.25f * static_cast<float>(c) - 0.5f * static_cast<float>(r));
  }
  const HeightGrid grid({60, 40}, {5e5, 4e6}, {2, -2}, heights);
  const DecimatedTerrain result = decimate_terrain(grid, 1e-6);
  EXPECT_EQ(result.mesh.triangles.size(), 2u);
  EXPECT_LT(result.deviation.largest_m, 1e-15);  // roundings in long double
}

// Without the rule for edges, the distance between samples is not bounded. The numbers of triangles
// are those that docs/theory/terrain.md quotes.
TEST(TerrainDecimation, BoundsWhatABoundOfSamplesDoesNot) {
  const HeightGrid grid = load_dem(testing::data_folder() / "terrain/jacksboro.tif").grid;
  const double max_error_m = 10;
  const DecimatedTerrain result = decimate_terrain(grid, max_error_m);
  const TerrainMesh exact = build_terrain_mesh(grid, {});
  MeasuredMesh mesh;
  mesh.shape.triangles = exact.triangles;
  for (const glm::ivec2& sample : exact.vertices)
    mesh.shape.vertices_m.emplace_back(grid.frame().to_D(sample),
                                       grid.height_m(sample.x, sample.y));
  const Simplified samples_only =
      simplify(mesh, VerticalBound{max_error_m, 0},
               {.crease_rad = std::numbers::pi, .fineness = {.samples = 100, .most_pieces = 100}});
  std::vector<glm::ivec2> places;
  for (const std::uint32_t source : samples_only.sources) places.push_back(exact.vertices[source]);
  const judge::MeshDeviation between =
      judge::largest_deviation(grid, places, samples_only.mesh.shape.triangles);
  EXPECT_GT(between.largest_m, 28);
  EXPECT_LE(result.deviation.largest_m, max_error_m);
  const auto percent = [&](std::size_t triangles) {
    return 100 * static_cast<double>(triangles) / static_cast<double>(exact.triangles.size());
  };
  EXPECT_NEAR(percent(result.mesh.triangles.size()), 15.1, 0.1);
  EXPECT_NEAR(percent(samples_only.mesh.shape.triangles.size()), 12.2, 0.1);
  EXPECT_NEAR(percent(build_terrain_mesh(grid, {.tolerance_m = max_error_m}).triangles.size()),
              95.5, 0.1);
}

TEST(TerrainDecimation, RejectsWhatHasNoMesh) {
  const HeightGrid grid = fractal(9, 1, 5, Seed{1});
  const float missing = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT([&] { decimate_terrain(grid, 0); },
              ThrowsMessage<Error>(HasSubstr("max_error_m = 0 must be positive")));
  EXPECT_THAT([&] { decimate_terrain(grid, std::nan("")); },
              ThrowsMessage<Error>(HasSubstr("nan")));
  EXPECT_THAT(
      [&] {
        decimate_terrain({{2, 2}, {0, 0}, {1, 1}, std::vector(4, missing)}, 1);
      },
      ThrowsMessage<Error>(HasSubstr("no facet")));
  EXPECT_THAT([&] { decimate_terrain(grid, 1, {.most_bytes = 1000}); },
              ThrowsMessage<Error>(HasSubstr("allow more memory")));
}

}  // namespace
}  // namespace groundray::terrain_decimation_test
