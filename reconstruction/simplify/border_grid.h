#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/simplify/collapsible_mesh.h"

namespace groundray {

/// Finds vertices of a mesh's border in the plan, so that borders that move do not cross others.
class BorderGrid {
 public:
  /// @param places_m  of each vertex of the mesh; what is above is not looked at.
  BorderGrid(const CollapsibleMesh& mesh, const std::vector<glm::dvec3>& places_m);

  /// A vertex and where it is in the plan.
  struct Entry {
    std::uint32_t vertex = 0;
    glm::dvec2 p_m{0};
  };

  /// Whether the triangle, whose corners are counter-clockwise, has a vertex of the border in it or
  /// on its sides, other than these three, that the mesh still has.
  bool has_any(const CollapsibleMesh& mesh, const std::array<Entry, 3>& corners) const;

 private:
  glm::ivec2 cell_of(const glm::dvec2& p_m) const noexcept;

  glm::dvec2 low_m_{0};
  double cell_m_ = 1;
  glm::ivec2 cells_{1, 1};
  std::vector<std::uint32_t> begins_;  // of each cell, and the end of the last
  std::vector<Entry> entries_;
};

}  // namespace groundray
