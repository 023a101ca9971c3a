#pragma once

#include <cstdint>
#include <vector>

#include "apps/golden/compare/scope.h"
#include "core/geometry/mesh.h"

namespace groundray::golden {

/// Part of a mesh, and the triangle of the whole mesh that each of its triangles is part of.
struct MeshPart {
  TriangleMesh mesh;
  std::vector<std::uint32_t> triangle_of;
};

/// Returns the part of a mesh within the box of a scope, in the mesh's frame; triangles that
/// intersect the box's faces are cut there.
/// @see Sutherland, Hodgman, Reentrant polygon clipping, Communications of the ACM 17 (1974).
MeshPart clipped(const TriangleMesh& mesh, const Scope& scope);

}  // namespace groundray::golden
