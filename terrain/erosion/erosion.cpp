#include "terrain/erosion/erosion.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/math.h"
#include "terrain/erosion/flow_tree.h"
#include "terrain/erosion/stream_power.h"
#include "terrain/erosion/talus.h"

namespace groundray {
namespace {

void check(const ErosionSpec& spec) {
  Violations broken("erosion");
  if (spec.streams) {
    const StreamPower& law = *spec.streams;
    const auto is_positive = [](double value) { return value > 0 && std::isfinite(value); };
    broken.unless(is_positive(law.years), "years = {} must be positive", law.years);
    broken.unless(law.erodibility >= 0 && std::isfinite(law.erodibility),
                  "erodibility = {} must be >= 0", law.erodibility);
    broken.unless(law.area_exponent >= 0 && law.area_exponent <= 2,
                  "area_exponent = {} must be from 0 to 2", law.area_exponent);
    broken.unless(law.slope_exponent >= 0.25 && law.slope_exponent <= 4,
                  "slope_exponent = {} must be from 0.25 to 4", law.slope_exponent);
    broken.unless(law.uplift_m_yr >= 0 && law.uplift_m_yr <= 0.1,
                  "uplift_m_yr = {} must be from 0 to 0.1: is it in metres?", law.uplift_m_yr);
    broken.unless(law.steps >= 1, "steps = {} must be at least 1", law.steps);
  }
  if (spec.talus_rad) {
    broken.unless(*spec.talus_rad > 0 && *spec.talus_rad < std::numbers::pi / 2,
                  "talus_rad = {} must be above 0 and below pi / 2", *spec.talus_rad);
  }
  broken.throw_if_any();
}

}  // namespace

HeightGrid eroded(const HeightGrid& ground, const ErosionSpec& spec, std::size_t memory_bytes) {
  check(spec);
  constexpr double bytes_per_sample = 72;  // heights, areas, tree, water's surface and queue
  const SampleGrid grid{{ground.columns(), ground.rows()}, glm::abs(ground.step_m())};
  const double bytes = bytes_per_sample * static_cast<double>(grid.count());
  if (bytes > static_cast<double>(memory_bytes)) {
    throw Error(
        "erosion of a DEM of {} x {} samples takes {:.0f} MiB, more than the limit of {:.0f}: cut "
        "the DEM, or raise memory_mib",
        grid.size.x, grid.size.y, std::ceil(bytes / (1 << 20)),
        static_cast<double>(memory_bytes) / (1 << 20));
  }
  std::vector<double> heights_m(ground.heights_m().begin(), ground.heights_m().end());
  const auto settle = [&] {
    if (spec.talus_rad) let_slide(grid, math::tan(*spec.talus_rad), heights_m);
  };
  settle();
  for (int step = 0; spec.streams && step < spec.streams->steps; ++step) {
    const FlowTree tree = flow_tree(grid, heights_m);
    incise(tree, tree.areas_m2(grid.step_m.x * grid.step_m.y), *spec.streams,
           spec.streams->years / spec.streams->steps, heights_m);
    settle();
  }
  return {grid.size, ground.origin_m(), ground.step_m(),
          std::vector<float>(heights_m.begin(), heights_m.end())};
}

}  // namespace groundray
