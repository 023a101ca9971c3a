#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/height_grid.h"
#include "core/leaf.h"
#include "core/ray_tracer.h"

namespace groundray::testing {

/// A triangle by the samples of the DEM at its corners.
using SampleTriangle = std::array<glm::ivec2, 3>;

/// Returns the triangles that leaves stand for, side by side, from the definition of thinned sides
/// in docs/terrain.md alone. Where a corner has no height there is no triangle.
std::vector<SampleTriangle> leaf_triangles(const HeightGrid& grid, std::span<const Leaf> leaves,
                                           int leaf_cells);

/// Returns the range of the first crossing from above of any of the triangles, tried one after the
/// other in long double.
std::optional<double> trace_triangles(const HeightGrid& grid,
                                      std::span<const SampleTriangle> triangles, const Ray& ray);

}  // namespace groundray::testing
