#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/height_grid.h"

namespace groundray::testing {

/// Returns what keeps the triangles from covering the facets of `grid` exactly once without
/// T-junctions, in words; nothing if they do. All in integers. The rules:
///  - vertices are samples with a height, all different, all in use;
///  - triangles have an area, and all one winding;
///  - an edge is used twice, in opposite directions, or once: then it is a chain of edges of facets
///    which are missing on its other side, or end there with the DEM;
///  - the areas add up to that of the facets, and V - E + F is that of the facets.
std::vector<std::string> topology_faults(const HeightGrid& grid,
                                         std::span<const glm::ivec2> vertices,
                                         std::span<const glm::uvec3> triangles);

}  // namespace groundray::testing
