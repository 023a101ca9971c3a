#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh.h"
#include "reconstruction/manifold_mesh.h"

namespace groundray {

/// The borders of a mesh as closed chains: the border after another is the one that ends where it
/// begins, for this is how triangles on the empty side would run.
struct MeshRims {
  std::vector<std::vector<HalfEdge>> chains;  ///< none passes a vertex twice
  std::vector<HalfEdge> next;  ///< of each half-edge that is a border: the next of its chain
};

/// Finds the rims of a mesh. Where several touch at a vertex each is a chain of its own.
MeshRims find_rims(const TriangleMesh& mesh, const EdgePairs& pairs);

/// The half-edges that begin at each vertex.
class VertexStars {
 public:
  VertexStars(const TriangleMesh& mesh, const EdgePairs& pairs);

  std::span<const HalfEdge> at(std::uint32_t vertex) const noexcept {
    return std::span(half_edges_).subspan(begins_[vertex], begins_[vertex + 1] - begins_[vertex]);
  }

  /// Returns whether a triangle has both vertices.
  bool has_edge(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b) const noexcept;

 private:
  std::vector<std::uint32_t> begins_;
  std::vector<HalfEdge> half_edges_;
};

}  // namespace groundray
