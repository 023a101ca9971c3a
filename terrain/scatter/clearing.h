#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "terrain/dem/density_map.h"

namespace groundray {

/// Ground to be kept free: all points within `half_width_m` of a line, or inside a polygon or
/// within `half_width_m` of its outline. A line of one point is a disc.
struct Clearing {
  enum class Shape : std::uint8_t { Line, Polygon };
  std::vector<glm::dvec2> points_D;  ///< in order; a polygon closes automatically
  double half_width_m = 0;
  Shape shape = Shape::Line;
};

/// Set of clearings, prepared for queries of many points. Immutable.
class ClearedGround {
 public:
  /// @throws Error listing clearings without points, polygons of fewer than three points, points
  ///         that are not finite, and half widths that are negative or not finite.
  explicit ClearedGround(std::span<const Clearing> clearings);

  /// Returns whether `p` (D) is to be kept free. Areas that a self-intersecting polygon covers
  /// twice are outside it.
  bool contains(glm::dvec2 p) const noexcept;

  /// Returns the part that matters within `area`: for points in `area`, both give the same answers.
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
