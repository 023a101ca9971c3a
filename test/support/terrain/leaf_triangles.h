#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/tracing/leaf.h"
#include "core/tracing/ray.h"

namespace groundray::testing {

/// A triangle, given by the DEM samples at its corners.
using SampleTriangle = std::array<glm::ivec2, 3>;

/// Returns the triangles that leaves represent, constructed side by side from the definition of
/// thinned sides in docs/theory/terrain.md alone. Triangles with a corner without a height are
/// omitted.
std::vector<SampleTriangle> leaf_triangles(const HeightGrid& grid, std::span<const Leaf> leaves,
                                           int leaf_cells);

/// Returns the range of the first crossing from above of any of the triangles, by brute force in
/// long double.
std::optional<double> trace_triangles(const HeightGrid& grid,
                                      std::span<const SampleTriangle> triangles, const Ray& ray);

}  // namespace groundray::testing
