#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/geometry/mesh.h"

namespace groundray::testing {

/// Returns the reasons why triangles are not a surface with or without boundary; empty if they are
/// one. The rules: indices are valid; the corners of a triangle differ; an edge has at most two
/// triangles, in opposite directions; and the triangles at a vertex are connected by edges.
std::vector<std::string> surface_faults(const TriangleMesh& mesh);

/// Vertices - edges + triangles, over used vertices: 2 for each ball, 1 for a disc, 0 for a tube.
std::ptrdiff_t euler_number(const TriangleMesh& mesh);

/// Number of edges with a single triangle.
std::size_t border_edges(const TriangleMesh& mesh);

/// Number of triangles without area in plan view, or clockwise from above.
std::size_t folds_in_plan(const TriangleMesh& mesh);

/// Sum of the triangles' areas.
double area_m2(const TriangleMesh& mesh);

/// Enclosed volume of a closed mesh; positive if its triangles face outwards.
double volume_m3(const TriangleMesh& mesh);

}  // namespace groundray::testing
