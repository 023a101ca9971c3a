#pragma once

#include <string>

#include "core/mesh.h"

namespace groundray {

/// Whether a mesh must have something to measure.
enum class EmptyMesh { Allow, Refuse };

/// @throws Error, with `name` at its head, naming every rule that the mesh breaks: positions are
///         finite and within 1e15 m of zero along each axis, vertices that are named exist, levels
///         are one for each triangle or none, and there is a triangle unless none is allowed.
void check_mesh(const TriangleMesh& mesh, const std::string& name, EmptyMesh empty);

}  // namespace groundray
