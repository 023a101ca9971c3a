#include "core/tracing/passes/trace_level.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "terrain/lod/clipmap.h"
#include "terrain/terrain_scene.h"
#include "test/support/terrain/hard_rays.h"
#include "test/support/terrain/pass_rays.h"
#include "test/support/terrain/sample_clipmap.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::trace_level_test {
namespace {

using testing::difference_from_exact;
using testing::fractal;
using testing::hard_rays;
using testing::proof_size;
using testing::trace_by_passes;
using testing::with_holes;

void expect_exact_hits(const std::vector<Level>& levels, const HeightGrid& grid, Seed seed) {
  const RayTracer tracer(levels, float_frame_origin({0, 0, grid.max_height_m()}), Tracing::Exact);
  const auto rays = hard_rays(grid, proof_size(100'000, 1'000'000), seed);
  std::size_t met = 0;
  EXPECT_EQ(difference_from_exact(trace_by_passes(tracer, rays, {}), tracer, rays, met), "");
  EXPECT_GT(met, rays.size() / 3);
}

TEST(TraceLevelPassProof, FindsTheHitsOfExactTracingAtFullResolution) {
  for (const int holes : {0, 60}) {
    const HeightGrid grid = with_holes(fractal(257, 5, 300, Seed{71}), holes, 5, Seed{72});
    Level level = full_resolution_level(grid);
    for (const bool has_quads : {false, true}) {  // the boxes of exact tracing depend on it
      level.has_quads = has_quads;
      expect_exact_hits({level}, grid, Seed{73});
    }
  }
}

TEST(TraceLevelPassProof, FindsTheHitsOfExactTracingOnNestedLevels) {
  for (const int holes : {0, 60}) {
    const HeightGrid grid = with_holes(fractal(513, 5, 300, Seed{74}), holes, 5, Seed{75});
    // The memory limit makes the windows small.
    const Clipmap clipmap(testing::certified_tiles(grid), grid.frame(),
                          {.tolerance_m = 0.01, .angle_rad = 0.002, .memory_bytes = 5'000'000},
                          testing::sensor_at({100, 50, 200}));
    ASSERT_GT(clipmap.levels().size(), 2u);
    expect_exact_hits(clipmap.levels(), grid, Seed{76});
  }
}

TEST(TraceLevelPass, RaysThatAreNotFiniteHitNothing) {
  const HeightGrid grid = fractal(33, 5, 100, Seed{77});
  const RayTracer tracer({full_resolution_level(grid)}, {0, 0, 0}, Tracing::Exact);
  std::vector<Ray> rays;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int axis = 0; axis < 3; ++axis) {
      rays.push_back({{1, 2, 500}, {0, 0, -1}});
      rays.back().origin[axis] = bad;
      rays.push_back({{1, 2, 500}, {0, 0, -1}});
      rays.back().direction[axis] = bad;
    }
  }
  for (const Crossing& hit : trace_by_passes(tracer, rays, {}))
    EXPECT_TRUE(std::isinf(hit.range_m)) << hit.range_m;
}

}  // namespace
}  // namespace groundray::trace_level_test
