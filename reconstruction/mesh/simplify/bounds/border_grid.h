#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/mesh/simplify/collapsible_mesh.h"

namespace groundray {

/// Grid of a mesh's boundary vertices in plan view, which prevents moving boundaries from crossing
/// others.
class BorderGrid {
 public:
  /// @param places_m  of each vertex of the mesh; z is ignored.
  BorderGrid(const CollapsibleMesh& mesh, const std::vector<glm::dvec3>& places_m);

  /// Vertex and its position in plan view.
  struct Entry {
    std::uint32_t vertex = 0;
    glm::dvec2 p_m{0};
  };

  /// Returns true if a triangle with counter-clockwise corners contains, inside or on its sides, a
  /// boundary vertex other than its corners that the mesh still has.
  bool has_any(const CollapsibleMesh& mesh, const std::array<Entry, 3>& corners) const;

 private:
  glm::ivec2 cell_of(const glm::dvec2& p_m) const noexcept;

  glm::dvec2 low_m_{0};
  double cell_m_ = 1;
  glm::ivec2 cells_{1, 1};
  std::vector<std::uint32_t> begins_;  // first entry of each cell, and the end of the last
  std::vector<Entry> entries_;
};

}  // namespace groundray
