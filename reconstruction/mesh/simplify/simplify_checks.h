#pragma once

#include "reconstruction/mesh/simplify/simplify.h"

namespace groundray {

/// @throws Error as simplify, except for overhangs and memory.
void check_simplify(const MeasuredMesh& mesh, const StopCriterion& stop,
                    const SimplifyOptions& options);

/// Returns a triangle that has no area in plan view or faces down, or `none`. Triangles that repeat
/// a vertex are ignored.
std::uint32_t overhanging_triangle(const TriangleMesh& mesh) noexcept;

/// @throws Error naming the triangle that overhangs.
void refuse_overhang(const TriangleMesh& mesh, std::uint32_t triangle);

}  // namespace groundray
