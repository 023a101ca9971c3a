#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "apps/scan/scan.h"

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

/// Pulses of a scan with their returns, in the order of their first returns.
struct Pulses {
  std::vector<std::uint32_t> returns;  ///< indices of the scan's returns, pulse by pulse
  std::vector<std::size_t> begins{0};  ///< start of each pulse in `returns`, and the end
  std::vector<glm::dvec3> directions;  ///< unit vector to each pulse's first return
  std::vector<double> rings, times;    ///< of each pulse's first return; empty if not available

  std::size_t size() const { return directions.size(); }
  std::span<const std::uint32_t> of(std::size_t pulse) const {
    return std::span(returns).subspan(begins[pulse], begins[pulse + 1] - begins[pulse]);
  }
};

/// Largest angle between directions that count as equal, rad.
constexpr double same_pulse_rad = 1e-5;

/// Returns, for each direction, the index of its representative: the first earlier direction within
/// same_pulse_rad that represents itself, or else its own index.
/// @param directions  unit vectors.
std::vector<std::uint32_t> firsts_of(const std::vector<glm::dvec3>& directions);

/// Groups the returns of a scan into pulses by number, else by ring and time, else by direction
/// (and by ring or time, if available). Times are ignored if they do not distinguish pulses: if
/// more than 16 returns share ring and time.
Pulses pulses_of(const Scan& scan);

}  // namespace groundray::golden
