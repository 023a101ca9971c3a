#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/height_grid.h"

namespace groundray::judge {

/// Returns the reasons why the triangles do not cover the facets of `grid` exactly once without
/// T-junctions; empty if they do. All tests are in integers. The rules:
///  - vertices are samples with a height, all different, all in use;
///  - triangles have non-zero area and a common winding;
///  - an edge is used twice, in opposite directions, or once: then it is a chain of facet edges on
///    whose other side facets are missing or the DEM ends;
///  - the areas sum to the area of the facets, and V - E + F equals that of the facets.
std::vector<std::string> topology_faults(const HeightGrid& grid,
                                         std::span<const glm::ivec2> vertices,
                                         std::span<const glm::uvec3> triangles);

}  // namespace groundray::judge
