#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <vector>

namespace groundray {

/// Smooth line in plan: points at equal distances along it, each with the line's unit tangent.
struct TangentLine {
  std::vector<glm::dvec2> points_m;  ///< at least two
  std::vector<glm::dvec2> tangents;
  double spacing_m = 0;  ///< from one point to the next, along the line

  double length_m() const noexcept { return spacing_m * static_cast<double>(points_m.size() - 1); }
};

/// Place of a point beside a line.
struct LinePlace {
  double along_m = 0;   ///< arc length from the line's start to the nearest point of the line
  double across_m = 0;  ///< distance from the line: positive to its left, negative to its right
};

/// Field of the places beside a line, for queries of many points. The line is the cubic Hermite
/// curve through its points. Immutable; any number of threads may query it.
class LineField {
 public:
  /// @param reach_m  distance up to which places are found; positive.
  LineField(TangentLine line, double reach_m);

  const TangentLine& line() const noexcept { return line_; }
  double reach_m() const noexcept { return reach_m_; }

  /// Returns the place of `p` beside the line, next to the nearest of its points; nothing beyond
  /// reach_m().
  std::optional<LinePlace> place(glm::dvec2 p) const noexcept;

 private:
  struct Bins {
    glm::dvec2 corner_m{0};
    double size_m = 1;
    glm::ivec2 count{0};
    std::vector<std::uint32_t> begins;  // in `points`, row by row, and one end
    std::vector<std::uint32_t> points;  // that may be the nearest to a point of the bin
  };
  LinePlace beside(std::size_t segment, glm::dvec2 p) const noexcept;

  TangentLine line_;
  double reach_m_;
  Bins bins_;
};

}  // namespace groundray
