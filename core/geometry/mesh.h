#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// Triangles with shared vertices.
struct TriangleMesh {
  std::vector<glm::dvec3> vertices_m;  ///< positions in D, metres
  std::vector<glm::uvec3> triangles;   ///< vertex indices, counter-clockwise as seen from outside
  /// Level of detail of each triangle: 0 is the finest. Empty if the mesh has no levels.
  std::vector<std::uint8_t> levels;
};

}  // namespace groundray
