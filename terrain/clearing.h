#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "terrain/area.h"

namespace groundray {

/// Ground to be kept free: all within `half_width_m` of a line, or in a polygon and within
/// `half_width_m` of its outline. A line of one point makes a disc.
struct Clearing {
  enum class Shape : std::uint8_t { Line, Polygon };
  std::vector<glm::dvec2> points_D;  ///< one after another; a polygon closes by itself
  double half_width_m = 0;
  Shape shape = Shape::Line;
};

/// Clearings, ready to be asked for many points. Immutable.
class ClearedGround {
 public:
  /// @throws Error listing clearings without points, polygons of fewer than three, and points or
  ///         widths that are not finite or negative.
  explicit ClearedGround(std::span<const Clearing> clearings);

  /// Whether `p` is to be kept free. What a polygon that crosses itself covers twice is outside.
  bool contains(glm::dvec2 p) const noexcept;

  /// Returns the parts that may matter within `area`: where it contains a point, so does this.
  ClearedGround near(const Area& area) const;

 private:
  struct Strip {
    glm::dvec2 from, to;
    double half_width_m;
  };
  ClearedGround() = default;

  std::vector<Strip> strips_;
  std::vector<std::vector<glm::dvec2>> polygons_;
};

}  // namespace groundray
