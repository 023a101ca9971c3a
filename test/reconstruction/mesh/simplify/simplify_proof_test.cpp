#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <ctime>
#include <glm/geometric.hpp>
#include <optional>
#include <random>
#include <utility>

#include "core/model/model.h"
#include "reconstruction/mesh/simplify/simplify.h"
#include "terrain/dem/dem_io.h"
#include "test/support/machine_speed.h"
#include "test/support/margin.h"
#include "test/support/scans/stanford_bunny.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/plan_check.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::simplify_proof_test {
namespace {

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

std::size_t peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024 * static_cast<std::size_t>(usage.ru_maxrss);
}

struct TerrainCase {
  const char* name;
  TriangleMesh mesh;
  double error_m;
  double most_share;  // as a fraction of the triangles
};

struct TimedResult {
  Simplified result;
  double took_s = 0;  // CPU time, without measuring the error
};

TimedResult simplify_timed(const TerrainCase& of) {
  const double begin_s = cpu_s();
  Simplified result = simplify({of.mesh}, VerticalBound{.error_m = of.error_m});
  const double measuring_s = cpu_s();
  two_sided_error(of.mesh, result.mesh.shape, SimplifyOptions().fineness);
  vertical_error(of.mesh.vertices_m, result.mesh.shape);
  return {std::move(result), 2 * measuring_s - begin_s - cpu_s()};
}

// The evaluator is independent of the simplification.
void expect_proved(const TerrainCase& of) {
  SCOPED_TRACE(of.name);
  const double most_s = 2 * testing::slowness();
  TimedResult timed = simplify_timed(of);
  if (testing::proof_size(0, 1) == 1) {  // other processes slow it down: one run of three suffices
    for (int i = 0; i < 2 && timed.took_s > most_s; ++i) timed = simplify_timed(of);
    EXPECT_LE(timed.took_s, most_s);
  }
  const TriangleMesh& coarse = timed.result.mesh.shape;
  const double share =
      static_cast<double>(coarse.triangles.size()) / static_cast<double>(of.mesh.triangles.size());
  EXPECT_LE(share, of.most_share);
  const testing::PlanCheck before = testing::check_plan({}, of.mesh);
  const testing::PlanCheck check = testing::check_plan(of.mesh.vertices_m, coarse);
  EXPECT_LE(check.largest_m, of.error_m * (1 + 1e-9));
  EXPECT_EQ(check.uncovered, 0u);
  EXPECT_EQ(check.turned_over, 0u);
  EXPECT_NEAR(check.area_m2, before.area_m2, 1e-9 * before.area_m2);
  EXPECT_EQ(testing::manifold_faults(coarse), 0u);
  const std::string what = fmt::format("{} at {} m: ", of.name, of.error_m);
  testing::record_margin(what + "share of triangles", share, of.most_share);
  testing::record_margin(what + "vertical error", check.largest_m, of.error_m, "m");
  testing::record_margin(what + "CPU time but for measuring", timed.took_s, most_s, "s");
  ::testing::Test::RecordProperty(what + "vertical RMS m", fmt::format("{:.4g}", check.rms_m));
}

// A greedy TIN (Delatin) of jacksboro needs 20.5 % and 4.9 % of the triangles.
TEST(SimplifyProof, RealTerrainNeedsFewTriangles) {
  const HeightGrid grid = load_dem(testing::data_folder() / "terrain/jacksboro.tif").grid;
  expect_proved({"jacksboro", testing::mesh_of(grid), 10, 0.123});
  expect_proved({"jacksboro", testing::mesh_of(grid), 30, 0.029});
}

// Reliefs are chosen so that a greedy TIN (Delatin) needs 12.7 % of the triangles at 0.1 m, and
// 1.93 % at 0.3 m.
TEST(SimplifyProof, FractalTerrainNeedsFewTriangles) {
  expect_proved(
      {"fractal", testing::mesh_of(testing::fractal(513, 0.5, 29.2, Seed{7})), 0.1, 0.08});
  expect_proved(
      {"fractal", testing::mesh_of(testing::fractal(513, 0.5, 33.2, Seed{7})), 0.3, 0.011});
}

TEST(SimplifyProof, ARealScanIsWithinTheBoundInBothDirections) {
  const std::optional<TriangleMesh> found = testing::stanford_bunny();
  if (!found) GTEST_SKIP() << testing::no_bunny;
  const TriangleMesh& bunny = *found;
  const ModelBounds bounds = bounds_of(bunny);
  const double diagonal_m = glm::length(bounds.high_m - bounds.low_m);
  struct Case {
    double share, most_triangles;
  };
  for (const auto& [share, most] : {Case{0.01, 0.01}, Case{0.003, 0.03}, Case{0.001, 0.11}}) {
    if (share < 0.01 && testing::proof_size(0, 1) == 0) continue;
    const double error_m = share * diagonal_m, tolerance_m = 0.01 * error_m;
    const Simplified result = simplify({bunny}, DistanceBound{error_m, error_m});
    const TriangleMesh& coarse = result.mesh.shape;
    EXPECT_LE(static_cast<double>(coarse.triangles.size()),
              most * static_cast<double>(bunny.triangles.size()));
    EXPECT_EQ(testing::manifold_faults(coarse), 0u);
    EXPECT_EQ(result.rounds, 1u) << "what each collapse proves is proved again of all";
    const LargestDistance forth = MeshDistance(bunny, coarse).largest(tolerance_m);
    const LargestDistance back = MeshDistance(coarse, bunny).largest(tolerance_m);
    EXPECT_LE(hausdorff(forth, back).at_least_m, error_m);
    EXPECT_LE(hausdorff(forth, back).at_most_m, error_m + tolerance_m);
    // Also by a million samples.
    const MeshDistance dense(coarse, bunny);
    const MeanDistance mean = dense.mean(dense.step_for_m(1e6));
    EXPECT_LE(*std::max_element(mean.largest_m.begin(), mean.largest_m.end()), error_m);
    testing::record_margin(fmt::format("bunny at {} of its diagonal: distance", share),
                           hausdorff(forth, back).at_least_m, error_m, "m");
  }
}

// Hills and noise of 0.1 m over cells of 1 m.
TriangleMesh noisy_hills(int samples) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> noise(-0.05f, 0.05f);
  std::vector<float> heights;
  for (int row = 0; row < samples; ++row) {
    for (int column = 0; column < samples; ++column)
      heights.push_back(static_cast<float>(5 * std::sin(0.03 * column) * std::cos(0.02 * row)) +
                        noise(random));
  }
  return testing::mesh_of({{samples, samples}, {0, 0}, {1, -1}, std::move(heights)});
}

// Total memory: for the runs and for measuring the error.
void expect_little_memory(int samples, const StopCriterion& stop) {
  const MeasuredMesh mesh{noisy_hills(samples)};
  const auto triangles = static_cast<double>(mesh.shape.triangles.size());
  const double before = static_cast<double>(peak_bytes());
  const Simplified result = simplify(mesh, stop);
  const double each = (static_cast<double>(peak_bytes()) - before) / triangles;
  EXPECT_LE(each, 660);  // what `simplify` expects of a grid
  EXPECT_LT(static_cast<double>(result.mesh.shape.triangles.size()), 0.1 * triangles);
  testing::record_margin("bytes of memory a triangle", each, 1000);
}

TEST(SimplifyProof, LargeMeshesUseLittleMemory) {
  const auto samples = static_cast<int>(testing::proof_size(513, 2238));
  expect_little_memory(samples, VerticalBound{.error_m = 0.3});
}

TEST(SimplifyProof, LargeMeshesUseLittleMemoryForADistanceBound) {
  const auto samples = static_cast<int>(testing::proof_size(129, 708));
  expect_little_memory(samples, DistanceBound{.error_m = 0.3, .border_m = 0.3});
}

TEST(SimplifyProof, LargeMeshesUseLittleMemoryForABudget) {
  const auto samples = static_cast<int>(testing::proof_size(513, 2238));
  expect_little_memory(samples, FaceBudget{static_cast<std::size_t>(0.04 * samples * samples)});
}

}  // namespace
}  // namespace groundray::simplify_proof_test
