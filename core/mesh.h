#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// Triangles that share vertices.
struct TriangleMesh {
  std::vector<glm::dvec3> vertices_m;  ///< positions in D, metres
  std::vector<glm::uvec3> triangles;   ///< vertices, counter-clockwise as seen from outside
  /// Of each triangle, its level of detail: 0 is the finest. Empty if there are none.
  std::vector<std::uint8_t> levels;
};

}  // namespace groundray
