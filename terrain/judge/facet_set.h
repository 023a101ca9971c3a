#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/vec2.hpp>

#include "core/geometry/height_grid.h"

namespace groundray::judge {

/// Number type of heights: 64 bits of mantissa on x86.
using Real = long double;

/// Columns and rows of a triangle's corners.
using Corners = std::array<glm::ivec2, 3>;

inline std::int64_t cross(glm::ivec2 a, glm::ivec2 b) {
  return std::int64_t{a.x} * b.y - std::int64_t{a.y} * b.x;
}

inline std::int64_t doubled_area(const Corners& t) { return cross(t[1] - t[0], t[2] - t[0]); }

/// One family of the lines that bound facets: rows, columns or anti-diagonals.
struct Family {
  glm::ivec2 level;  ///< normal: on each of its lines, dot(level, point) is constant and an integer
  glm::ivec2 along;  ///< step from a sample on a line to the next
};
inline constexpr Family rows{{0, 1}, {1, 0}};
inline constexpr Family columns{{1, 0}, {0, 1}};
inline constexpr Family diagonals{{1, 1}, {1, -1}};
inline constexpr std::array families{rows, columns, diagonals};

inline int level_of(const Family& family, glm::ivec2 p) {
  return family.level.x * p.x + family.level.y * p.y;
}

/// The facets of a grid: their existence and their edges.
class FacetSet {
 public:
  explicit FacetSet(const HeightGrid& grid)
      : grid_(grid), last_(grid.columns() - 1, grid.rows() - 1) {}

  bool whole() const { return grid_.hole_count() == 0; }
  glm::ivec2 last() const { return last_; }
  bool inside(glm::ivec2 p) const {
    return 0 <= p.x && p.x <= last_.x && 0 <= p.y && p.y <= last_.y;
  }
  double height_m(glm::ivec2 p) const { return static_cast<double>(grid_.height_m(p.x, p.y)); }
  bool has_height(glm::ivec2 p) const { return inside(p) && !std::isnan(height_m(p)); }

  static Corners near(glm::ivec2 cell) { return {cell, cell + rows.along, cell + columns.along}; }
  static Corners far(glm::ivec2 cell) {
    return {cell + glm::ivec2(1), cell + columns.along, cell + rows.along};
  }
  bool exists(const Corners& facet) const {
    return has_height(facet[0]) && has_height(facet[1]) && has_height(facet[2]);
  }

  /// Returns the two facets that share the edge from sample `a` to the next along a line of the
  /// family.
  static std::array<Corners, 2> beside(const Family& family, glm::ivec2 a) {
    if (family.level == diagonals.level) {
      const glm::ivec2 cell = a - columns.along;
      return {near(cell), far(cell)};
    }
    return {near(a), far(a - family.level)};
  }
  bool edge_exists(const Family& family, glm::ivec2 a) const {
    const auto facets = beside(family, a);
    return exists(facets[0]) || exists(facets[1]);
  }
  bool sample_exists(glm::ivec2 p) const {
    for (const Family& family : families) {
      if (edge_exists(family, p) || edge_exists(family, p - family.along)) return true;
    }
    return false;
  }

 private:
  const HeightGrid& grid_;
  glm::ivec2 last_;
};

}  // namespace groundray::judge
