#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace groundray {

/// Triangles with shared vertices.
struct TriangleMesh {
  std::vector<glm::dvec3> vertices_m;  ///< positions in D, metres
  std::vector<glm::uvec3> triangles;   ///< vertex indices, counter-clockwise as seen from outside
  /// Level of detail of each triangle: 0 is the finest. Empty if the mesh has no levels.
  std::vector<std::uint8_t> levels;
};

/// Treatment of a mesh without triangles.
enum class EmptyMesh { Allow, Refuse };

/// @throws Error, beginning with `name`, listing every rule that the mesh breaks: positions are
///         finite and within 1e15 m of zero along each axis; vertex indices are valid; levels are
///         none or one for each triangle; and there is a triangle unless an empty mesh is allowed.
void check_mesh(const TriangleMesh& mesh, const std::string& name, EmptyMesh empty);

}  // namespace groundray
