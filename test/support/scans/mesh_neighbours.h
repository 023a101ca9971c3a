#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "core/geometry/mesh.h"

namespace groundray::testing {

/// Marks a missing neighbour.
constexpr std::uint32_t no_neighbour = 0xffffffff;

/// Returns for each triangle the triangles across its edges; edge k runs from corner k to corner (k
/// + 1) % 3. Edges are identified by the positions of their ends, in either direction. Boundary
/// edges have `no_neighbour`, and so have edges of more than two triangles and edges of zero
/// length.
std::vector<glm::uvec3> neighbours_of(const TriangleMesh& mesh);

}  // namespace groundray::testing
