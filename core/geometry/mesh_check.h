#pragma once

#include <string>

#include "core/geometry/mesh.h"

namespace groundray {

/// Treatment of a mesh without triangles.
enum class EmptyMesh { Allow, Refuse };

/// @throws Error, beginning with `name`, listing every rule that the mesh breaks: positions are
///         finite and within 1e15 m of zero along each axis; vertex indices are valid; levels are
///         none or one for each triangle; and there is a triangle unless an empty mesh is allowed.
void check_mesh(const TriangleMesh& mesh, const std::string& name, EmptyMesh empty);

}  // namespace groundray
