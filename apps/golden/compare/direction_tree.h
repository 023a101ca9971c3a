#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray::golden {

/// Returns the angle between two vectors that are not zero, radians; exact near 0 and pi.
double angle_between(const glm::dvec3& a, const glm::dvec3& b);

/// Unit vectors, to be found by their neighbours: a k-d tree. Immutable.
class DirectionTree {
 public:
  explicit DirectionTree(std::vector<glm::dvec3> directions);

  /// Calls `take` for each direction at `most_rad` or less from `direction`, in an order of its
  /// own.
  void for_each_within(
      const glm::dvec3& direction, double most_rad,
      const std::function<void(std::uint32_t index, double angle_rad)>& take) const;

  /// Returns the angle to the nearest direction that is more than `least_rad` away, or infinity.
  double nearest_beyond(const glm::dvec3& direction, double least_rad) const;

 private:
  void split(std::size_t begin, std::size_t end, int axis);
  template <typename Visit>
  void walk(std::size_t begin, std::size_t end, int axis, const glm::dvec3& direction,
            const double& most_chord, const Visit& visit) const;

  std::vector<glm::dvec3> directions_;
  std::vector<std::uint32_t> order_;  // of each part the middle one splits it, by x, y, z in turn
};

}  // namespace groundray::golden
