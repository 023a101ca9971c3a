#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <unordered_set>
#include <vector>

#include "reconstruction/mesh/merge/stitched_mesh.h"

namespace groundray {

/// Boundary of a surface to which triangles are added. Triangles lie to the left of its edges.
class OpenBorder {
 public:
  /// @param stitched  as from make_manifold.
  explicit OpenBorder(const StitchedMesh& stitched);

  /// Returns the vertices of the initial boundary.
  const std::vector<std::uint32_t>& vertices() const { return vertices_; }

  /// Returns the ends of the boundary edges that begin at a vertex; before() returns the beginnings
  /// of those that end there.
  std::span<const std::uint32_t> after(std::uint32_t vertex) const {
    return after_[number_of_[vertex]];
  }
  std::span<const std::uint32_t> before(std::uint32_t vertex) const {
    return before_[number_of_[vertex]];
  }

  bool has(std::uint32_t from, std::uint32_t to) const;
  bool has(std::uint32_t vertex) const { return !after(vertex).empty(); }

  /// Returns true if an edge, in this direction, has no triangle yet.
  bool is_free(std::uint32_t from, std::uint32_t to) const;

  /// Adds a triangle whose corners were on the initial boundary and whose edges are free.
  void add(const glm::uvec3& triangle);

 private:
  static std::uint64_t key_of(std::uint32_t from, std::uint32_t to) {
    return std::uint64_t{from} << 32 | to;
  }

  std::vector<std::uint32_t> vertices_;
  std::vector<std::uint32_t> number_of_;  // of each vertex of the merged mesh: index in `vertices_`
  std::vector<std::vector<std::uint32_t>> after_, before_;
  // Edges between these vertices that have a triangle on each side.
  std::unordered_set<std::uint64_t> inner_;
};

}  // namespace groundray
