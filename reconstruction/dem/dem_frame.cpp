#include "reconstruction/dem/dem_frame.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace groundray {
namespace {

constexpr double most_samples_per_side = 1 << 30;

void refuse_area(Violations& broken, const Area& area) {
  const bool is_bounded = std::isfinite(area.low_m.x) && std::isfinite(area.low_m.y) &&
                          std::isfinite(area.high_m.x) && std::isfinite(area.high_m.y);
  broken.unless(is_bounded && !area.is_empty(),
                "the area ({}, {}) to ({}, {}) m must be bounded and not empty", area.low_m.x,
                area.low_m.y, area.high_m.x, area.high_m.y);
}

// Range of samples: the first, counted from the sample at `zero_m`, and their number, at least two.
struct SampleRange {
  double first = 0;
  double count = 0;
};

// Returns the samples, counted from the one at zero_m, whose cells overlap the interval's interior.
SampleRange samples_over(double low_m, double high_m, double zero_m, double step_m) {
  const double a = (low_m - zero_m) / step_m + 0.5, b = (high_m - zero_m) / step_m + 0.5;
  const double low = std::min(a, b), high = std::max(a, b);
  // Cell boundaries that equal an area's except for rounding add no cells.
  const double slack = 1e-9 * std::max({1.0, std::abs(low), std::abs(high)});
  const double first = std::floor(low + slack);
  return {first, std::max(2.0, std::ceil(high - slack) - first)};
}

GridFrame frame_of(const Area& area, glm::dvec2 zero_m, glm::dvec2 step_m) {
  const SampleRange x = samples_over(area.low_m.x, area.high_m.x, zero_m.x, step_m.x);
  const SampleRange y = samples_over(area.low_m.y, area.high_m.y, zero_m.y, step_m.y);
  if (std::max(x.count, y.count) > most_samples_per_side) {
    throw Error(
        "cells of {} x {} m over {:.6g} x {:.6g} m are {:.3g} x {:.3g}: more than 2^30 along a "
        "side; choose larger cells or a smaller area",
        std::abs(step_m.x), std::abs(step_m.y), area.high_m.x - area.low_m.x,
        area.high_m.y - area.low_m.y, x.count, y.count);
  }
  return {.samples = {static_cast<int>(x.count), static_cast<int>(y.count)},
          .origin_m = zero_m + glm::dvec2(x.first, y.first) * step_m,
          .step_m = step_m,
          .cells_per_m = 1.0 / step_m};
}

}  // namespace

GridFrame frame_over(const Area& area, double cell_m) {
  Violations broken("frame of a DEM");
  refuse_area(broken, area);
  broken.unless(std::isfinite(cell_m) && cell_m > 0, "cell_m = {} must be above 0", cell_m);
  broken.throw_if_any();
  return frame_of(area, glm::dvec2(0.5, -0.5) * cell_m, {cell_m, -cell_m});
}

GridFrame frame_like(const GridFrame& like, const Area& area, int finer) {
  refuse_faults(like);
  Violations broken("frame of a DEM");
  refuse_area(broken, area);
  broken.unless(finer >= 1, "finer = {} must be at least 1", finer);
  broken.throw_if_any();
  return frame_of(area, like.origin_m, like.step_m / static_cast<double>(finer));
}

void refuse_faults(const GridFrame& frame) {
  Violations broken("frame of a DEM");
  broken.unless(frame.samples.x >= 2 && frame.samples.y >= 2,
                "{} x {} samples must be at least 2 x 2", frame.samples.x, frame.samples.y);
  broken.unless(std::isfinite(frame.origin_m.x) && std::isfinite(frame.origin_m.y),
                "origin_m = ({}, {}) must be finite", frame.origin_m.x, frame.origin_m.y);
  for (int axis = 0; axis < 2; ++axis) {
    const double step_m = frame.step_m[axis], per_m = frame.cells_per_m[axis];
    broken.unless(std::isfinite(step_m) && step_m != 0,
                  "step_m = {} along axis {} must be finite and not 0", step_m, axis);
    broken.unless(std::abs(step_m * per_m - 1) < 1e-9,
                  "cells_per_m = {} along axis {} must be 1 / step_m, where step_m = {}", per_m,
                  axis, step_m);
  }
  broken.throw_if_any();
}

}  // namespace groundray
