#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/mesh.h"

namespace groundray::testing {

/// Returns what keeps triangles from being a surface with or without borders, in words; nothing if
/// they are one. The rules: indices are valid, corners of a triangle differ, an edge has at most
/// two triangles, which run it in opposite directions, and those at a vertex hang together by
/// edges.
std::vector<std::string> surface_faults(const TriangleMesh& mesh);

/// Vertices - edges + triangles, of vertices in use: 2 for each ball, 1 for a disc, 0 for a tube.
std::ptrdiff_t euler_number(const TriangleMesh& mesh);

/// Edges of one triangle.
std::size_t border_edges(const TriangleMesh& mesh);

/// The sum of the triangles' areas.
double area_m2(const TriangleMesh& mesh);

/// What triangles enclose, if nothing is open; positive if they are wound to face outwards.
double volume_m3(const TriangleMesh& mesh);

}  // namespace groundray::testing
