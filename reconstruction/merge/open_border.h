#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <unordered_set>
#include <vector>

#include "reconstruction/merge/quilt.h"

namespace groundray {

/// The border of a surface that triangles are added to. Triangles are on the left of its edges.
class OpenBorder {
 public:
  /// @param quilt  as make_manifold gives.
  explicit OpenBorder(const Quilt& quilt);

  /// Returns the vertices that were on the border at first.
  const std::vector<std::uint32_t>& vertices() const { return vertices_; }

  /// Returns where edges of the border that begin at a vertex end, and where those that end there
  /// begin.
  std::span<const std::uint32_t> after(std::uint32_t vertex) const {
    return after_[number_of_[vertex]];
  }
  std::span<const std::uint32_t> before(std::uint32_t vertex) const {
    return before_[number_of_[vertex]];
  }

  bool has(std::uint32_t from, std::uint32_t to) const;
  bool has(std::uint32_t vertex) const { return !after(vertex).empty(); }

  /// Whether an edge, run this way, has no triangle yet.
  bool is_free(std::uint32_t from, std::uint32_t to) const;

  /// Adds a triangle whose corners were on the border at first and whose edges are free.
  void add(const glm::uvec3& triangle);

 private:
  static std::uint64_t key_of(std::uint32_t from, std::uint32_t to) {
    return std::uint64_t{from} << 32 | to;
  }

  std::vector<std::uint32_t> vertices_;
  std::vector<std::uint32_t> number_of_;  // of each vertex of the quilt, among those
  std::vector<std::vector<std::uint32_t>> after_, before_;
  std::unordered_set<std::uint64_t>
      inner_;  // edges between those that have a triangle on each side
};

}  // namespace groundray
