#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/random.h"
#include "core/tracing/ray.h"

namespace groundray::testing {

/// Returns points where facets adjoin: samples, and points on column lines, row lines and
/// diagonals.
std::vector<glm::dvec3> seam_points(const HeightGrid& grid, std::size_t count, Seed seed);

/// Returns rays from all sides, also from below ground, aimed at points where facets adjoin.
std::vector<Ray> aimed_rays(const HeightGrid& grid, std::size_t count, Seed seed);

/// Returns rays whose facets are hard to tell, in equal shares: random ones, those aimed at points
/// where facets adjoin, and those exactly or almost along the lines of the grid, down or level.
std::vector<Ray> hard_rays(const HeightGrid& grid, std::size_t count, Seed seed);

}  // namespace groundray::testing
