#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/manifold_mesh.h"

namespace groundray {

/// Boundary of a mesh as closed chains. The successor of an edge is the one that ends where it
/// begins, which is the direction of triangles on the empty side.
struct MeshBoundary {
  std::vector<std::vector<HalfEdge>> chains;  ///< none passes a vertex twice
  std::vector<HalfEdge> next;                 ///< of each boundary half-edge: its successor
};

/// Finds the boundary chains of a mesh. Where several touch at a vertex, each is a chain of its
/// own.
MeshBoundary find_boundary(const TriangleMesh& mesh, const EdgePairs& pairs);

/// Half-edges that begin at each vertex.
class VertexStars {
 public:
  VertexStars(const TriangleMesh& mesh, const EdgePairs& pairs);

  std::span<const HalfEdge> at(std::uint32_t vertex) const noexcept {
    return half_edges_.at(vertex);
  }

  /// Returns true if a triangle has both vertices.
  bool has_edge(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b) const noexcept;

 private:
  Buckets half_edges_;
};

/// Boundary of a hole, joined with the outlines of pieces of surface inside it to a single chain.
struct BridgedBoundary {
  std::vector<std::uint32_t> vertices;
  std::vector<glm::uvec3> bridges;  ///< two triangles per piece, by the mesh's vertices
};

/// Joins an outline to a boundary by two triangles at a position where both are close and the
/// triangles intersect none of their neighbours.
/// @param boundary, outline  vertices, in the winding order of triangles that fill them.
/// @return nothing if they share a vertex or there is no such position.
std::optional<BridgedBoundary> bridge(const TriangleMesh& mesh, const VertexStars& stars,
                                      BridgedBoundary boundary,
                                      std::span<const std::uint32_t> outline);

/// Numbers the connected pieces of a mesh.
/// @return for each triangle, the number of its piece; `none` for dropped triangles.
std::vector<std::uint32_t> number_pieces(const EdgePairs& pairs);

}  // namespace groundray
