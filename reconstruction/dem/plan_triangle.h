#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>

#include "core/geometry/grid_frame.h"

// Samples within the plan of a triangle, private to this library.
namespace groundray {

/// Interval of columns of a triangle's plan in a row; low above high if the triangle does not reach
/// the row.
struct PlanSpan {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

/// Returns the interval in a row of a triangle given in columns and rows, slightly too wide.
inline PlanSpan span_in_row(const std::array<glm::dvec2, 3>& p, double row) {
  constexpr double rounding = 1e-9;
  PlanSpan span;
  const auto add = [&span](double at) {
    span.low = std::min(span.low, at - rounding * (1 + std::abs(at)));
    span.high = std::max(span.high, at + rounding * (1 + std::abs(at)));
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec2 a = p[k], b = p[(k + 1) % 3];
    const auto [top, bottom] = std::minmax(a.y, b.y);
    const double slack = rounding * (1 + std::abs(top) + std::abs(bottom));
    if (row < top - slack || row > bottom + slack) continue;
    if (bottom - top <= 2 * slack) {
      add(a.x);
      add(b.x);
    } else {
      add(a.x + std::clamp((row - a.y) / (b.y - a.y), 0.0, 1.0) * (b.x - a.x));
    }
  }
  return span;
}

/// Calls `visit(column, row, height_m)` for each sample of the frame in the triangle's plan,
/// including its boundary; never for an upright triangle. The time is proportional to the number of
/// these samples and rows.
template <typename Visit>
void visit_samples(const GridFrame& frame, const std::array<glm::dvec3, 3>& corners_m,
                   const Visit& visit) {
  std::array<glm::dvec2, 3> p;
  for (std::size_t k = 0; k < 3; ++k) p[k] = frame.to_grid(glm::dvec2(corners_m[k]));
  const auto cross = [](glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; };
  const double area = cross(p[1] - p[0], p[2] - p[0]);
  if (area == 0) return;
  const auto [top, bottom] = std::minmax({p[0].y, p[1].y, p[2].y});
  static constexpr double most = 1 << 30;  // beyond any frame
  const auto first = [](double at) {
    return static_cast<int>(std::ceil(std::clamp(at, 0.0, most)));
  };
  const auto last = [](double at, int count) {
    return static_cast<int>(std::floor(std::clamp(at, -1.0, count - 1.0)));
  };
  for (int row = first(top); row <= last(bottom, frame.samples.y); ++row) {
    const PlanSpan span = span_in_row(p, row);
    const int end = last(span.high, frame.samples.x);
    for (int column = first(span.low); column <= end; ++column) {
      const glm::dvec2 q(column, row);
      const double b = cross(q - p[0], p[2] - p[0]) / area;
      const double c = cross(p[1] - p[0], q - p[0]) / area;
      constexpr double rounding = 1e-12;
      if (b < -rounding || c < -rounding || b + c > 1 + rounding) continue;
      visit(column, row,
            corners_m[0].z + b * (corners_m[1].z - corners_m[0].z) +
                c * (corners_m[2].z - corners_m[0].z));
    }
  }
}

}  // namespace groundray
