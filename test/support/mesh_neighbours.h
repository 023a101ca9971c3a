#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "core/mesh.h"

namespace groundray::testing {

/// Stands for the triangle that is not there.
constexpr std::uint32_t no_neighbour = 0xffffffff;

/// Returns for each triangle the triangles across its edges; edge k runs from corner k to corner
/// (k + 1) % 3. Edges are the same where their ends have equal positions, whichever way they run.
/// Borders have `no_neighbour`, and so have edges of more than two triangles and edges without
/// length.
std::vector<glm::uvec3> neighbours_of(const TriangleMesh& mesh);

}  // namespace groundray::testing
