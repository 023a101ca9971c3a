#pragma once

#include "reconstruction/simplify/simplify.h"

namespace groundray {

/// @throws Error as simplify, but for overhangs and memory.
void check_simplify(const MeasuredMesh& mesh, const Halt& halt, const SimplifyOptions& options);

/// Returns a triangle that has no area as seen from above or shows its underside, or none. Those
/// that name a vertex twice are not looked at.
std::uint32_t overhanging_triangle(const TriangleMesh& mesh) noexcept;

/// @throws Error naming the triangle that hangs over.
void refuse_overhang(const TriangleMesh& mesh, std::uint32_t triangle);

}  // namespace groundray
