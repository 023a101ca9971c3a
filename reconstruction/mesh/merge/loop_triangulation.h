#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace groundray {

/// Triangulation of a closed loop.
struct LoopTriangles {
  std::vector<glm::uvec3> triangles;  ///< numbers of the loop's corners, wound as the loop is
  bool is_upright = true;             ///< true if no triangle faces away from the normal
};

/// Triangulates a nearly flat loop of at least three corners. Minimises the area that is turned
/// over and, among equal choices, the lengths of the diagonals.
/// @param normal  direction about which the loop runs counter-clockwise.
/// @see Barequet, Sharir, Filling gaps in the boundary of a polyhedron, Computer Aided Geometric
///      Design 12(2) (1995), for the dynamic program; loops of more than 40 corners are
///      triangulated by cutting ears.
LoopTriangles triangulate_loop(std::span<const glm::dvec3> loop, const glm::dvec3& normal);

}  // namespace groundray
