#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"

namespace groundray {

/// Numbers vertices by position, from 0: those at equal positions get equal numbers.
std::vector<std::uint32_t> place_numbers(const std::vector<glm::dvec3>& vertices_m);

/// Triangles round each corner of a mesh: all that have a corner at the same position, whether or
/// not they share the vertex, in ascending order. Twins are triangles with the same three corner
/// positions.
class CornerStars {
 public:
  explicit CornerStars(const TriangleMesh& mesh);

  std::span<const std::uint32_t> round(std::uint32_t vertex) const noexcept {
    const std::uint32_t place = places_[vertex];
    return std::span(triangles_).subspan(first_[place], first_[place + 1] - first_[place]);
  }

  /// Returns the next of a triangle's twins, in cyclic order; the triangle itself if it has none.
  std::uint32_t next_twin(std::uint32_t triangle) const noexcept {
    return twins_.empty() ? triangle : twins_[triangle];
  }

 private:
  void link_twins(const TriangleMesh& mesh);

  std::vector<std::uint32_t> places_;  // position number of each vertex; equal for equal positions
  std::vector<std::uint32_t> first_;   // for each position, first index into triangles_
  std::vector<std::uint32_t> triangles_;
  std::vector<std::uint32_t> twins_;  // for each triangle, its next twin; empty if there are none
};

}  // namespace groundray
