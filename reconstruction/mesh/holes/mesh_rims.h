#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/manifold_mesh.h"

namespace groundray {

/// Boundary of a mesh as closed chains. The successor of an edge is the one that ends where it
/// begins, which is the direction of triangles on the empty side.
struct MeshRims {
  std::vector<std::vector<HalfEdge>> chains;  ///< none passes a vertex twice
  std::vector<HalfEdge> next;                 ///< of each boundary half-edge: its successor
};

/// Finds the boundary chains of a mesh. Where several touch at a vertex, each is a chain of its
/// own.
MeshRims find_rims(const TriangleMesh& mesh, const EdgePairs& pairs);

/// Half-edges that begin at each vertex.
class VertexStars {
 public:
  VertexStars(const TriangleMesh& mesh, const EdgePairs& pairs);

  std::span<const HalfEdge> at(std::uint32_t vertex) const noexcept {
    return std::span(half_edges_).subspan(begins_[vertex], begins_[vertex + 1] - begins_[vertex]);
  }

  /// Returns true if a triangle has both vertices.
  bool has_edge(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b) const noexcept;

 private:
  std::vector<std::uint32_t> begins_;
  std::vector<HalfEdge> half_edges_;
};

}  // namespace groundray
