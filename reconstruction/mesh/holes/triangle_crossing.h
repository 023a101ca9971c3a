#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/geometry/mesh.h"

namespace groundray {

/// Finds the triangles that intersect other than at shared corners and edges, by exact predicates
/// on the positions as given. Corners at equal positions count as shared. Triangles without area
/// are ignored.
/// @param first  only pairs with a triangle from this number on are tested.
/// @return pairs, smaller number first, sorted.
std::vector<std::pair<std::uint32_t, std::uint32_t>> crossings(const TriangleMesh& mesh,
                                                               std::uint32_t first);

}  // namespace groundray
