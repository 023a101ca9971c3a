#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// Finds points near a place. Immutable; any number of threads may ask.
class PointTree {
 public:
  explicit PointTree(std::vector<glm::dvec3> points_m);

  /// Returns the numbers of the points that are no farther than `within_m`, in an order of its own.
  std::vector<std::uint32_t> near(const glm::dvec3& place_m, double within_m) const;

 private:
  // Halved again and again: the one in the middle of a part is no lower along its axis than those
  // before it, and no higher than those behind it.
  std::vector<glm::dvec3> points_m_;
  std::vector<std::uint32_t> numbers_;
};

}  // namespace groundray
