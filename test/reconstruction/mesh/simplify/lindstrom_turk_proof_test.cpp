#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/height_grid.h"
#include "reconstruction/mesh/accuracy/accuracy.h"
#include "reconstruction/mesh/simplify/lindstrom_turk.h"
#include "terrain/dem/dem_io.h"
#include "test/support/margin.h"
#include "test/support/scans/stanford_bunny.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/sample_terrain.h"
#include "test/support/terrain/surface_check.h"

namespace groundray::lindstrom_turk_proof_test {
namespace {

// Root mean square of the vertical distances between the mesh and the grid's samples.
double vertical_rms_m(const HeightGrid& grid, const TriangleMesh& mesh) {
  std::vector<double> error_m(grid.heights_m().size(), std::nan(""));
  const auto columns = static_cast<std::size_t>(grid.columns());
  for (const glm::uvec3& t : mesh.triangles) {
    std::array<glm::dvec3, 3> p;  // column, row, height
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& v = mesh.vertices_m[t[k]];
      p[static_cast<std::size_t>(k)] = {(glm::dvec2(v) - grid.origin_m()) / grid.step_m(), v.z};
    }
    const auto across = [](const glm::dvec3& a, const glm::dvec3& b, glm::dvec2 c) {
      return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    };
    const double area = across(p[0], p[1], p[2]);
    const auto [left, right] = std::minmax({p[0].x, p[1].x, p[2].x});
    const auto [low, high] = std::minmax({p[0].y, p[1].y, p[2].y});
    for (int row = std::max(0, static_cast<int>(std::ceil(low)));
         row <= std::min<double>(high, grid.rows() - 1); ++row) {
      for (int column = std::max(0, static_cast<int>(std::ceil(left)));
           column <= std::min<double>(right, grid.columns() - 1); ++column) {
        const glm::dvec2 at(column, row);
        const double a = across(p[1], p[2], at) / area, b = across(p[2], p[0], at) / area;
        if (std::min({a, b, 1 - a - b}) < -1e-9) continue;
        const double height_m = a * p[0].z + b * p[1].z + (1 - a - b) * p[2].z;
        error_m[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)] =
            height_m - grid.height_m(column, row);
      }
    }
  }
  double sum = 0;
  std::size_t count = 0;
  for (const double e : error_m) {
    if (std::isnan(e)) continue;
    sum += e * e;
    ++count;
  }
  // The border keeps its area, not its place: some samples of a rough border lie beyond it.
  EXPECT_GT(static_cast<double>(count), 0.995 * static_cast<double>(error_m.size()));
  return std::sqrt(sum / static_cast<double>(count));
}

// Results of CGAL's own edge_collapse with this cost and placement, measured with other programs.
TEST(LindstromTurkProof, IsAsAccurateAsCgalOnADem) {
  const HeightGrid grid = load_dem(testing::data_folder() / "terrain/jacksboro.tif").grid;
  const TriangleMesh mesh = testing::mesh_of(grid);
  struct Case {
    double share, rms_m;
  };
  for (const auto& [share, rms_m] : {Case{0.02, 10.9}, Case{0.1, 3.55}}) {
    const auto triangles =
        static_cast<std::size_t>(share * static_cast<double>(mesh.triangles.size()));
    const ReducedMesh reduced = reduce(mesh, triangles);
    EXPECT_LE(reduced.mesh.triangles.size(), triangles);
    EXPECT_EQ(testing::folds_in_plan(reduced.mesh), 0u);
    const double found_m = vertical_rms_m(grid, reduced.mesh);
    EXPECT_LE(found_m, 1.02 * rms_m);
    testing::record_margin(fmt::format("RMS height error of a DEM at {} of its triangles", share),
                           found_m, 1.02 * rms_m, "m");
  }
}

// Results of CGAL 5.5's edge_collapse on the same fractals.
TEST(LindstromTurkProof, IsAsAccurateAsCgalOnAFractal) {
  const bool is_full = testing::proof_size(0, 1) == 1;
  const HeightGrid grid = testing::fractal(is_full ? 1025 : 257, 0.5, 40, Seed{7});
  const TriangleMesh mesh = testing::mesh_of(grid);
  const ReducedMesh reduced = reduce(mesh, mesh.triangles.size() / 50);
  EXPECT_EQ(testing::folds_in_plan(reduced.mesh), 0u);
  const double found_m = vertical_rms_m(grid, reduced.mesh), cgal_m = is_full ? 0.043218 : 0.16119;
  EXPECT_LE(found_m, 1.05 * cgal_m);
  testing::record_margin("RMS height error of a fractal at a fiftieth of its triangles", found_m,
                         1.05 * cgal_m, "m");
}

TEST(LindstromTurkProof, IsAsAccurateAsCgalOnTheBunny) {
  const std::optional<TriangleMesh> bunny = testing::stanford_bunny();
  if (!bunny) GTEST_SKIP() << testing::no_bunny;
  const TriangleMesh& mesh = *bunny;
  const ReducedMesh reduced = reduce(mesh, mesh.triangles.size() / 50);
  EXPECT_EQ(testing::euler_number(reduced.mesh), testing::euler_number(mesh));
  constexpr double diagonal_m = 0.2502;  // of the bounding box
  const double limit_m = 1.02 * 0.00075 * diagonal_m;
  for (const auto& distance :
       {MeshDistance(mesh, reduced.mesh), MeshDistance(reduced.mesh, mesh)}) {
    const double found_m = distance.mean(distance.step_for_m(3e5)).rms.value_m;
    EXPECT_LE(found_m, limit_m);
    testing::record_margin("RMS distance of the bunny at a fiftieth of its triangles", found_m,
                           limit_m, "m");
  }
}

}  // namespace
}  // namespace groundray::lindstrom_turk_proof_test
