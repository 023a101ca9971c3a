#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace groundray {

/// Triangles between the corners of a loop.
struct LoopTriangles {
  std::vector<glm::uvec3> triangles;  ///< that name corners of the loop, and run as it does
  bool is_upright = true;             ///< none of them is turned away from the normal
};

/// Covers a loop of at least three corners, nearly flat, with triangles: with the least area that
/// is turned over, if need be, and of those the ones with the shortest diagonals.
/// @param normal  about which the loop runs counter-clockwise.
/// @see Barequet, Sharir, Filling gaps in the boundary of a polyhedron, Computer Aided Geometric
///      Design 12(2) (1995), for the dynamic program; loops of more than 40 corners are cut ear by
///      ear.
LoopTriangles triangulate_loop(std::span<const glm::dvec3> loop, const glm::dvec3& normal);

}  // namespace groundray
