#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh.h"

namespace groundray {

/// The triangles round each corner of a mesh: all that have a corner at the same position, whether
/// or not they share the vertex, in ascending order.
class CornerStars {
 public:
  explicit CornerStars(const TriangleMesh& mesh);

  std::span<const std::uint32_t> round(std::uint32_t vertex) const noexcept {
    const std::uint32_t place = places_[vertex];
    return std::span(triangles_).subspan(first_[place], first_[place + 1] - first_[place]);
  }

 private:
  std::vector<std::uint32_t> places_;  // of each vertex; equal positions have equal ones
  std::vector<std::uint32_t> first_;   // of each place, index among the triangles
  std::vector<std::uint32_t> triangles_;
};

}  // namespace groundray
