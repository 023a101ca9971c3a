#pragma once

#include <optional>

#include "core/geometry/height_grid.h"
#include "core/tracing/ray.h"

namespace groundray::testing {

/// Direct implementation of the definition of the reference surface: every cell that the ray passes
/// over is visited in order, every triangle is a plane through its three samples, all in long
/// double. Slow, shares no code with the library, and is the oracle of every ray test.
struct ReferenceHit {
  double range_m = 0;
  int column = 0;
  int row = 0;
  bool far_half = false;
};

/// Returns the first crossing from above within [0, ray.far_m].
std::optional<ReferenceHit> trace_reference(const HeightGrid& grid, const Ray& ray);

/// Returns the surface's height at a point of D, from the same planes; NaN outside and in holes.
double reference_height_m(const HeightGrid& grid, double x_m, double y_m);

}  // namespace groundray::testing
