#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/mesh.h"

namespace groundray {

/// Finds the triangles that meet elsewhere than at corners and edges that they share, by exact
/// arithmetic on the positions as they are. Corners at equal positions count as shared. Triangles
/// without an area are left out.
/// @param first  only pairs with a triangle from here on are looked at.
/// @return pairs, the lesser number first, sorted.
std::vector<std::pair<std::uint32_t, std::uint32_t>> crossings(const TriangleMesh& mesh,
                                                               std::uint32_t first);

}  // namespace groundray
