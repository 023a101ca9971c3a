#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh.h"

namespace groundray {

/// The triangles round each corner of a mesh: all that have a corner at the same position, whether
/// or not they share the vertex, in ascending order. Twins have all three corners in common.
class CornerStars {
 public:
  explicit CornerStars(const TriangleMesh& mesh);

  std::span<const std::uint32_t> round(std::uint32_t vertex) const noexcept {
    const std::uint32_t place = places_[vertex];
    return std::span(triangles_).subspan(first_[place], first_[place + 1] - first_[place]);
  }

  /// Leads round all twins of a triangle, from each to another; to itself if it has none.
  std::uint32_t next_twin(std::uint32_t triangle) const noexcept {
    return twins_.empty() ? triangle : twins_[triangle];
  }

 private:
  void link_twins(const TriangleMesh& mesh);

  std::vector<std::uint32_t> places_;  // of each vertex; equal positions have equal ones
  std::vector<std::uint32_t> first_;   // of each place, index among the triangles
  std::vector<std::uint32_t> triangles_;
  std::vector<std::uint32_t> twins_;  // of each triangle the next; empty if there are none
};

}  // namespace groundray
