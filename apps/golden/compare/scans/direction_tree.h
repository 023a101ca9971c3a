#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray::golden {

/// Returns the angle between two nonzero vectors, rad; accurate near 0 and pi.
double angle_between(const glm::dvec3& a, const glm::dvec3& b);

/// k-d tree of unit vectors for neighbour queries. Immutable.
class DirectionTree {
 public:
  explicit DirectionTree(std::vector<glm::dvec3> directions);

  /// Calls `take` for each direction at most `most_rad` from `direction`, in unspecified order.
  void for_each_within(
      const glm::dvec3& direction, double most_rad,
      const std::function<void(std::uint32_t index, double angle_rad)>& take) const;

  /// Returns the angle to the nearest direction that is more than `least_rad` away, rad; infinity
  /// if there is none.
  double nearest_beyond(const glm::dvec3& direction, double least_rad) const;

 private:
  void split(std::size_t begin, std::size_t end, int axis);
  template <typename Visit>
  void walk(std::size_t begin, std::size_t end, int axis, const glm::dvec3& direction,
            const double& most_chord, const Visit& visit) const;

  std::vector<glm::dvec3> directions_;
  std::vector<std::uint32_t> order_;  // middle of each range splits it, by x, y, z cyclically
};

}  // namespace groundray::golden
