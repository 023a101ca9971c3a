#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// Search tree for points near a position. Immutable; safe for concurrent use.
class PointTree {
 public:
  explicit PointTree(std::vector<glm::dvec3> points_m);

  /// Returns the numbers of the points that are at most `within_m` away, in the tree's order.
  std::vector<std::uint32_t> near(const glm::dvec3& place_m, double within_m) const;

 private:
  // Implicit k-d tree: along its axis, the middle point of a part is no lower than the points
  // before it and no higher than those behind it.
  std::vector<glm::dvec3> points_m_;
  std::vector<std::uint32_t> numbers_;
};

}  // namespace groundray
