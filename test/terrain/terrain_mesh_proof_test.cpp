// Tests the guarantees of build_terrain_mesh with the oracles of test/support.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

#include "terrain/dem/dem_io.h"
#include "terrain/judge/mesh_deviation.h"
#include "terrain/judge/mesh_topology.h"
#include "terrain/terrain_mesh.h"
#include "test/support/environment.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/adversarial_terrain.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::terrain_mesh_proof_test {
namespace {

using ::testing::IsEmpty;
using testing::proof_size;

constexpr std::array tolerances_m{0.1, 0.3, 1.0, 3.0, 10.0, 50.0};
constexpr std::array block_sizes{2, 4, 8};

// Relative rounding of the library, which certifies in double: at most eight products, sums and
// differences of numbers no larger than the heights. Comparing the bound itself takes as many
// operations.
constexpr double rounding = 8 * std::numeric_limits<double>::epsilon();

// Rounding of the oracle itself; see its header.
constexpr double oracle_rounding_m = 1e-14;

double distance_m(const glm::dvec3& p, const MeshBound& bound) {
  return glm::distance(p, glm::clamp(p, bound.low_m, bound.high_m));
}

// Deviation permitted at a point of the surface. A leaf's distance is that of its box, which
// contains the point, so the point is at least as far away.
double allowed_m(const HeightGrid& grid, const MeshBound& bound, const glm::dvec3& point) {
  const glm::dvec2 step_m = glm::abs(grid.step_m());
  const glm::dvec3 p_m = point * glm::dvec3(step_m, 1);
  const double angular_m = bound.angle_rad == 0 ? 0 : bound.angle_rad * distance_m(p_m, bound);
  return std::max(bound.tolerance_m, angular_m) * (1 + rounding);
}

// Checks a mesh against all guarantees that hold for any mesh.
void expect_keeps_its_promises(const HeightGrid& grid, const MeshBound& bound,
                               const TerrainMesh& mesh) {
  const auto faults = judge::topology_faults(grid, mesh.vertices, mesh.triangles);
  ASSERT_THAT(faults, IsEmpty());
  ASSERT_EQ(mesh.levels.size(), mesh.triangles.size());
  ASSERT_TRUE(std::ranges::is_sorted(mesh.levels));
  if (mesh.triangles.empty()) return;
  const auto corner = [&](int i) {
    return glm::dvec2(mesh.vertices[mesh.triangles[0][i]]) * grid.step_m();
  };
  const glm::dvec2 a = corner(1) - corner(0);
  const glm::dvec2 b = corner(2) - corner(0);
  EXPECT_GT(a.x * b.y - a.y * b.x, 0) << "triangles must be counter-clockwise from above";

  const auto allowed = [&](const glm::dvec3& point) { return allowed_m(grid, bound, point); };
  const judge::MeshDeviation found =
      judge::largest_deviation(grid, mesh.vertices, mesh.triangles, allowed);
  const double heights_m = std::max(std::abs(grid.min_height_m()), std::abs(grid.max_height_m()));
  EXPECT_LE(found.largest_excess_m, rounding * heights_m)
      << found.largest_m << " m at (" << found.place.x << ", " << found.place.y << ")";
  if (bound.angle_rad == 0 && bound.tolerance_m > 0)
    testing::record_margin("deviation", found.largest_m, bound.tolerance_m, "m");
  EXPECT_EQ(found.over_missing, 0u) << found.missing_cell.x << ", " << found.missing_cell.y;
}

std::string text(const MeshBound& bound, int block_cells) {
  return fmt::format("tolerance {} m, angle {} rad from ({}, {}, {}), blocks of {}",
                     bound.tolerance_m, bound.angle_rad, bound.low_m.x, bound.low_m.y,
                     bound.low_m.z, block_cells);
}

void expect_mesh_keeps_its_promises(const HeightGrid& grid, const MeshBound& bound,
                                    int block_cells) {
  SCOPED_TRACE(text(bound, block_cells));
  expect_keeps_its_promises(grid, bound, build_terrain_mesh(grid, bound, block_cells));
}

// Random position in or around the grid, most often near the ground, sometimes the bounding box of
// a drive; angles of 0.1 to 10 mrad.
MeshBound random_viewpoint(const HeightGrid& grid, std::uint32_t number) {
  const auto uniform = [number](std::uint32_t of) {
    return random_uniform({.seed = Seed{77}, .sensor = number, .frame = of});
  };
  const glm::dvec2 extent_m = glm::dvec2(grid.columns() - 1, grid.rows() - 1) * grid.step_m();
  const bool holes_only = !std::isfinite(grid.min_height_m());
  const double floor_m = holes_only ? 0 : grid.min_height_m();
  const double relief_m = holes_only ? 1 : grid.max_height_m() - floor_m;
  const glm::dvec2 place = (uniform(0) * 1.4 - 0.2) * glm::abs(extent_m);
  const double up = uniform(1).x;
  MeshBound bound;
  bound.low_m = {place, floor_m + relief_m * (up * up * 3 - 0.5)};
  bound.high_m = bound.low_m;
  if (number % 4 == 3) bound.high_m += 0.2 * glm::dvec3(uniform(2) * glm::abs(extent_m), relief_m);
  bound.angle_rad = std::pow(10.0, -4 + 2 * uniform(3).x);
  bound.tolerance_m = number % 3 == 0 ? 0 : std::pow(10.0, -2 + 3 * uniform(3).y);
  return bound;
}

void expect_every_mesh_keeps_its_promises(const HeightGrid& grid, std::size_t viewpoints) {
  for (const int block_cells : block_sizes) {
    for (const double tolerance_m : tolerances_m) {
      expect_mesh_keeps_its_promises(grid, {.tolerance_m = tolerance_m}, block_cells);
    }
    for (std::uint32_t i = 0; i < viewpoints; ++i) {
      expect_mesh_keeps_its_promises(grid, random_viewpoint(grid, i), block_cells);
    }
  }
}

TEST(TerrainMeshProof, AdversarialTerrainStaysWithinTheBoundWithoutCracks) {
  for (const auto& [name, grid] : testing::adversarial_terrain()) {
    SCOPED_TRACE(name);
    expect_every_mesh_keeps_its_promises(grid, proof_size(1, 50));
  }
}

TEST(TerrainMeshProof, BundledDemsStayWithinTheBoundWithoutCracks) {
  for (const char* name : {"jacksboro.tif", "prairie_1m.tif"}) {
    SCOPED_TRACE(name);
    const Dem dem = load_dem(testing::data_folder() / "terrain" / name);
    expect_every_mesh_keeps_its_promises(dem.grid, proof_size(1, 100));
  }
}

TEST(TerrainMeshProof, FractalTerrainStaysWithinTheBoundWithoutCracks) {
  const auto samples = static_cast<int>(proof_size(257, 2049));
  const HeightGrid ground = testing::fractal(samples, 5, 1500, Seed{12345});
  expect_every_mesh_keeps_its_promises(ground, proof_size(1, 5));
  expect_every_mesh_keeps_its_promises(testing::with_holes(ground, 40, 9, Seed{3}),
                                       proof_size(1, 5));
}

TEST(TerrainMeshProof, PublicDemsStayWithinTheBoundWithoutCracks) {
  const auto dems = testing::shared_data_folder() / "dem";
  if (!std::filesystem::exists(dems)) {
    GTEST_SKIP() << "there are no public DEMs in " << dems << "; set GROUNDRAY_SHARED_DATA";
  }
  struct Source {
    std::string path;
    DemOptions options = {};
  };
  std::vector<Source> sources{{"gz_common_edge_cases/dem_moon.tif"},
                              {"gz_common_edge_cases/dem_nodata.dem"},
                              {"gz_common_edge_cases/dem_nodata_nan.nc"},
                              {"lidar_dsm_dtm_2m/dtm.tif"},
                              {"crater_lake_dem_and_image/craterlake-elev-16bit-30m.tif",
                               {.nodata = -32767, .reproject_to = "utm"}}};
  const bool all = proof_size(0, 1) == 1;
  if (all) {
    sources.push_back({"lidar_dsm_dtm_2m/dsm.tif"});
    sources.push_back({"bigtujunga_30m/bigtujunga.tif"});
    for (const char* name : {"dem_portrait.tif", "dem_landscape.tif", "dem_squared.tif"}) {
      sources.push_back({fmt::format("gz_common_edge_cases/{}", name), {.reproject_to = "utm"}});
    }
    for (const char* tile : {"N36W003", "N36W004", "N36W005", "N37W003", "N37W004", "N37W005"}) {
      sources.push_back({fmt::format("/vsizip/{}/srtm3_sierra_nevada/{}.hgt.zip/{}.hgt",
                                     dems.string(), tile, tile),
                         {.reproject_to = "utm"}});
    }
  }
  const testing::Environment permission("GROUNDRAY_RASTER_DRIVERS", "netCDF");
  for (const auto& [path, options] : sources) {
    SCOPED_TRACE(path);
    const Dem dem = load_dem(dems / path, options);  // an absolute path remains unchanged
    expect_every_mesh_keeps_its_promises(dem.grid, proof_size(1, 10));
  }
  if (!all) return;
  // 8193 x 8193 samples: each mesh takes a minute, so only some are built.
  const Dem moon =
      load_dem(dems / "moon_gld100_8193/moon_gld100_8193.tif", {.reproject_to = "utm"});
  for (const double tolerance_m : {3.0, 50.0}) {
    expect_mesh_keeps_its_promises(moon.grid, {.tolerance_m = tolerance_m}, 2);
  }
  expect_mesh_keeps_its_promises(moon.grid, random_viewpoint(moon.grid, 4), 8);
}

TEST(TerrainMeshProof, PlaneIsTwoTrianglesAtAnySize) {
  for (const auto& [name, grid] : testing::planes()) {
    for (const int block_cells : block_sizes) {
      for (const double tolerance_m : {0.0, 0.1, 50.0}) {
        SCOPED_TRACE(name);
        const MeshBound bound{.tolerance_m = tolerance_m};
        const TerrainMesh mesh = build_terrain_mesh(grid, bound, block_cells);
        EXPECT_EQ(mesh.triangles.size(), 2u);
        EXPECT_EQ(mesh.vertices.size(), 4u);
        expect_keeps_its_promises(grid, bound, mesh);
      }
    }
  }
}

TEST(TerrainMeshProof, ZeroToleranceKeepsEveryFacetOfNoise) {
  for (const glm::ivec2 size : {glm::ivec2(33, 33), glm::ivec2(2, 2), glm::ivec2(50, 23),
                                glm::ivec2(2, 40), glm::ivec2(31, 64)}) {
    for (const int block_cells : block_sizes) {
      const HeightGrid noise = testing::white_noise(size, 30, Seed{5});
      const TerrainMesh mesh = build_terrain_mesh(noise, {}, block_cells);
      // There are as many triangles as facets and none deviates: they are the facets.
      EXPECT_EQ(std::ssize(mesh.triangles), 2 * (size.x - 1) * (size.y - 1));
      EXPECT_LT(judge::largest_deviation(noise, mesh.vertices, mesh.triangles).largest_m,
                oracle_rounding_m);
      expect_keeps_its_promises(noise, {}, mesh);
    }
  }
}

TEST(TerrainMeshProof, ZeroToleranceHasNoDeviation) {
  for (const auto& [name, grid] : testing::adversarial_terrain()) {
    SCOPED_TRACE(name);
    const TerrainMesh mesh = build_terrain_mesh(grid, {});
    EXPECT_LT(judge::largest_deviation(grid, mesh.vertices, mesh.triangles).largest_m,
              oracle_rounding_m);
  }
}

TEST(TerrainMeshProof, TerrainWithoutFacetsIsAnEmptyMesh) {
  constexpr float hole = std::numeric_limits<float>::quiet_NaN();
  for (const int block_cells : block_sizes) {
    const HeightGrid nothing({5, 6}, {0, 0}, {1, 1}, std::vector<float>(30, hole));
    EXPECT_TRUE(build_terrain_mesh(nothing, {}, block_cells).vertices.empty());
    const HeightGrid lone({3, 3}, {0, 0}, {1, 1}, {1, hole, 2, hole, hole, hole, hole, hole, 3});
    EXPECT_TRUE(build_terrain_mesh(lone, {}, block_cells).vertices.empty());
  }
}

std::vector<std::int64_t> places_of(const TerrainMesh& mesh) {
  std::vector<std::int64_t> places;
  for (const glm::ivec2 p : mesh.vertices) places.push_back((std::int64_t{p.y} << 32) + p.x);
  std::ranges::sort(places);
  return places;
}

// Leaves of a larger tolerance are unions of those of a smaller one, so the fine mesh contains
// every sample of the coarse one.
void expect_monotone(const HeightGrid& grid, MeshBound bound, int block_cells) {
  bound.tolerance_m = 0;
  std::vector<std::int64_t> finer = places_of(build_terrain_mesh(grid, bound, block_cells));
  std::size_t most_triangles = std::numeric_limits<std::size_t>::max();
  for (double tolerance_m = 0.01; tolerance_m < 100; tolerance_m *= 1.7) {
    bound.tolerance_m = tolerance_m;
    SCOPED_TRACE(text(bound, block_cells));
    const TerrainMesh mesh = build_terrain_mesh(grid, bound, block_cells);
    EXPECT_LE(mesh.triangles.size(), most_triangles);
    std::vector<std::int64_t> places = places_of(mesh);
    EXPECT_TRUE(std::ranges::includes(finer, places));
    most_triangles = mesh.triangles.size();
    finer = std::move(places);
  }
}

TEST(TerrainMeshProof, LargerToleranceOnlyRemovesSamples) {
  const HeightGrid ground = testing::fractal(129, 5, 200, Seed{8});
  for (const int block_cells : block_sizes) {
    for (const HeightGrid& grid : {ground, testing::with_holes(ground, 12, 4, Seed{1}),
                                   testing::white_noise({70, 45}, 8, Seed{2})}) {
      expect_monotone(grid, {}, block_cells);
      for (std::uint32_t i = 0; i < proof_size(1, 20); ++i) {
        expect_monotone(grid, random_viewpoint(grid, i), block_cells);
      }
    }
  }
}

}  // namespace
}  // namespace groundray::terrain_mesh_proof_test
