#pragma once

#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <limits>

namespace groundray {

/// Rectangle in the plane of D. It includes its lower sides but not its upper ones, so that
/// adjacent rectangles share no point. The default is the whole plane.
struct Area {
  glm::dvec2 low_m{-std::numeric_limits<double>::infinity()};
  glm::dvec2 high_m{std::numeric_limits<double>::infinity()};

  bool contains(glm::dvec2 p) const noexcept {
    return low_m.x <= p.x && p.x < high_m.x && low_m.y <= p.y && p.y < high_m.y;
  }
  bool is_empty() const noexcept { return !(low_m.x < high_m.x && low_m.y < high_m.y); }
  /// Returns the intersection; empty if the rectangles do not overlap.
  Area operator&(const Area& other) const noexcept {
    return {glm::max(low_m, other.low_m), glm::min(high_m, other.high_m)};
  }
};

}  // namespace groundray
