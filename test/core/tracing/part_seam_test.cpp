#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "terrain/lod/clipmap.h"
#include "terrain/terrain_scene.h"
#include "test/support/terrain/sample_clipmap.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::part_seam_test {
namespace {

HeightGrid ground(double step_m, double origin_m) {
  const HeightGrid rough = testing::fractal(129, 2, 40, Seed{5});
  return {{129, 129},
          {origin_m - 64 * step_m, origin_m + 64 * step_m},
          {step_m, -step_m},
          {rough.heights_m().begin(), rough.heights_m().end()}};
}

// Rays along a column or a row, exactly, almost, or beside it by almost nothing.
std::vector<Ray> rays_along(const HeightGrid& grid, int line, bool is_row) {
  constexpr double off_line[] = {0, 1e-17, -1e-17, 1e-13, -1e-10, 1e-8, -1e-6, 1e-4};
  std::vector<Ray> rays;
  for (int i = 0; i < 2000; ++i) {
    const double along = 128 * (i + 0.37) / 2000, beside = line + (i / 5 % 3 - 1) * 1e-7;
    const glm::dvec2 place = is_row ? glm::dvec2(along, beside) : glm::dvec2(beside, along);
    const glm::dvec2 p_m = grid.origin_m() + place * grid.step_m();
    const double way = i % 2 == 0 ? 1 : -1, off = off_line[i / 7 % 8], down = -0.02 - i % 50 * 0.01;
    const glm::dvec3 direction = is_row ? glm::dvec3(way, off, down) : glm::dvec3(off, way, down);
    rays.push_back(
        {{p_m, grid.height_m_at(p_m).value_or(0) + 1 + i % 7 * 0.5}, glm::normalize(direction)});
  }
  return rays;
}

// The float positions of the lines are rounded, unless the step is a power of two.
TEST(PartSeam, FastTracingMissesNoRayAlongIt) {
  for (const double step_m : {2.0, 0.1}) {
    for (const double origin_m : {0.0, 1234.567}) {
      const HeightGrid grid = ground(step_m, origin_m);
      const Clipmap clipmap(testing::certified_tiles(grid), grid.frame(), {.tolerance_m = 0.02},
                            testing::sensor_at({0, 0, 60}));
      ASSERT_LT(clipmap.levels()[0].part_cells, 128);
      const glm::dvec3 p_DL = float_frame_origin({0, 0, grid.max_height_m()});
      const RayTracer exact(clipmap.levels(), p_DL, Tracing::Exact);
      const RayTracer fast(clipmap.levels(), p_DL, Tracing::Fast);
      std::size_t met = 0, rays_traced = 0;
      for (const int line : {32, 63, 64, 96}) {
        for (const bool is_row : {true, false}) {
          const auto rays = rays_along(grid, line, is_row);
          std::vector<Hit> expected(rays.size()), found(rays.size());
          exact.trace(rays, expected);
          fast.trace(rays, found);
          for (std::size_t i = 0; i < rays.size(); ++i) {
            met += expected[i] ? 1 : 0;
            ASSERT_EQ(found[i].range_m, expected[i].range_m) << i << " along line " << line;
          }
          rays_traced += rays.size();
        }
      }
      EXPECT_GT(met, rays_traced / 4);
    }
  }
}

}  // namespace
}  // namespace groundray::part_seam_test
