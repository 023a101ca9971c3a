#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/surface_mesh.h"

namespace groundray {

constexpr std::uint32_t no_vertex = 0xffffffff;

/// Vertex of a mesh that is sewn together from scans.
struct StitchedVertex {
  glm::dvec3 p{0};
  glm::vec3 normal{0};  ///< unit, from its scan
  float sd_m = 0, confidence = 1;
  std::uint16_t label = 0;
  std::uint32_t scan = 0;
  std::uint32_t vertex = no_vertex;   ///< of that scan; `no_vertex` if it lies on an edge
  std::uint32_t nearest = no_vertex;  ///< of that scan: itself, or the nearer end of its edge
  /// True if another scan covers it, or it belongs to a triangle that covers another scan's vertex.
  bool is_shared = true;
};

/// Mesh under construction from the triangles of several scans.
struct StitchedMesh {
  std::vector<StitchedVertex> vertices;
  std::vector<glm::uvec3> triangles;
};

/// Returns the vertex at the fraction `share` of the way between two others.
StitchedVertex between(const StitchedVertex& from, const StitchedVertex& to, double share);

TriangleMesh mesh_of(const StitchedMesh& stitched);
SurfaceMesh surface_of(const StitchedMesh& stitched);
std::vector<float> sds_of(const StitchedMesh& stitched);

/// Makes a manifold surface with boundaries: each edge has at most two triangles, which traverse it
/// in opposite directions, and the triangles at each vertex form a single fan. Removes triangles
/// that repeat a vertex, or traverse an edge in the same direction as an earlier one; separates
/// fans by duplicating vertices. Returns the number of removed triangles.
std::size_t make_manifold(StitchedMesh& stitched);

/// Position on the edge between two vertices.
struct EdgePlace {
  std::uint32_t from = 0, to = 0;  ///< vertices, in either order
  double share = 0;                ///< fraction of the way, above 0 and below 1
};

/// Splits edges: inserts a vertex at each position, all of them distinct, and subdivides the
/// triangles at the edge. Returns the vertices' numbers in the order of the positions.
std::vector<std::uint32_t> split_edges(StitchedMesh& stitched, std::span<const EdgePlace> places);

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
