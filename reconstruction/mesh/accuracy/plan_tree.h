#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <limits>
#include <vector>

#include "core/geometry/mesh.h"

/// Triangles in plan view, for measurements of height. Not installed.
namespace groundray {

/// Bounding-box tree that finds the triangles of a mesh near a position in plan view.
class PlanTree {
 public:
  /// @param mesh  at least one triangle; used only during construction.
  explicit PlanTree(const TriangleMesh& mesh);

  /// Calls `visit(triangle)` for at least each triangle whose bounding box is within `reach_m` of a
  /// position along both axes, in an order that depends only on the mesh.
  template <typename Visit>
  void visit_near(const glm::dvec2& p_m, double reach_m, const Visit& visit) const {
    std::array<std::size_t, 64> open{1};  // at most two per level
    for (std::size_t count = 1; count > 0;) {
      const std::size_t node = open[--count];
      if (!boxes_[node].is_near(p_m, reach_m)) continue;
      if (node < leaves_) {
        open[count++] = 2 * node + 1;
        open[count++] = 2 * node;
        continue;
      }
      const std::size_t first = (node - leaves_) * in_leaf;
      for (std::size_t i = first; i < std::min(first + in_leaf, order_.size()); ++i)
        visit(order_[i]);
    }
  }

 private:
  static constexpr std::size_t in_leaf = 4;

  struct Box {
    glm::dvec2 low_m{std::numeric_limits<double>::infinity()};
    glm::dvec2 high_m{-std::numeric_limits<double>::infinity()};

    bool is_near(const glm::dvec2& p_m, double reach_m) const noexcept {
      return p_m.x >= low_m.x - reach_m && p_m.x <= high_m.x + reach_m &&
             p_m.y >= low_m.y - reach_m && p_m.y <= high_m.y + reach_m;
    }
  };

  std::size_t leaves_ = 1;  // number of leaves, a power of two
  std::vector<Box> boxes_;  // of node i, whose children are 2 i and 2 i + 1; the root is 1
  std::vector<std::uint32_t> order_;  // triangles in the order of leaves
};

}  // namespace groundray
