#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace groundray {

/// One triangle of the reference surface: a half of the cell between samples (column, row) and
/// (column+1, row+1), split along the diagonal from sample (column+1, row) to sample (column,
/// row+1).
struct Facet {
  enum class Half : std::uint8_t {
    Near,  ///< the half that holds sample (column, row)
    Far,   ///< the half that holds sample (column+1, row+1)
  };
  int column = 0;
  int row = 0;
  Half half = Half::Near;
  friend bool operator==(const Facet&, const Facet&) = default;
};

/// The plane of a facet over grid coordinates: z = height_m + u_slope_m u + v_slope_m v, metres per
/// cell.
struct FacetPlane {
  double height_m = 0;
  double u_slope_m = 0;
  double v_slope_m = 0;
};

/// A ray in grid coordinates: at t metres along it u = u0 + t du (columns), v = v0 + t dv (rows), z
/// = z0 + t dz (m).
struct GridRay {
  double u0 = 0, v0 = 0, z0 = 0;
  double du = 0, dv = 0, dz = 0;
};

/// Where a ray crosses the surface from above.
struct Crossing {
  double range_m = std::numeric_limits<double>::infinity();
  Facet facet;
};

/// The reference surface: heights on a regular grid, joined by two triangles in each cell (see
/// Facet). Sample (column, row) lies at origin_m + (column, row) * step_m in the plane of D. A NaN
/// height is a hole: triangles that touch it do not exist. Immutable; copies share the samples; any
/// number of threads may read one.
class HeightGrid {
 public:
  /// @param size       columns and rows of samples, each at least 2.
  /// @param origin_m   position of sample (0, 0) in D, metres.
  /// @param step_m     from one sample to the next, metres; a component may be negative (rasters
  /// run north to south).
  /// @param heights_m  size.x * size.y heights, row by row; NaN where there is none.
  /// @throws Error if the sizes disagree, a step is zero or not finite, or a height is infinite.
  HeightGrid(glm::ivec2 size, glm::dvec2 origin_m, glm::dvec2 step_m, std::vector<float> heights_m);

  int columns() const { return size_.x; }
  int rows() const { return size_.y; }
  glm::dvec2 origin_m() const { return origin_m_; }
  glm::dvec2 step_m() const { return step_m_; }
  /// 1 / step_m: what turns metres into grid coordinates.
  glm::dvec2 cells_per_m() const { return cells_per_m_; }
  std::span<const float> heights_m() const { return *heights_m_; }

  /// Lowest and highest height, metres; NaN if every sample is a hole.
  double min_height_m() const { return min_height_m_; }
  double max_height_m() const { return max_height_m_; }
  /// Number of samples without a height.
  std::size_t hole_count() const { return hole_count_; }

  float height_m(int column, int row) const noexcept {
    return samples_[static_cast<std::ptrdiff_t>(row) * size_.x + column];
  }

  /// Returns the surface's height below or above `p` (D, metres); nothing outside the grid or in a
  /// hole.
  std::optional<double> height_m_at(glm::dvec2 p) const noexcept;

  /// Returns `p` (D, metres) in grid coordinates: column and row, fractions included.
  glm::dvec2 to_grid(glm::dvec2 p) const noexcept { return (p - origin_m_) * cells_per_m_; }

  /// Returns the ray from `origin` along the unit vector `direction`, both in D.
  GridRay to_grid(const glm::dvec3& origin, const glm::dvec3& direction) const noexcept;

  /// Returns the plane of `facet`; NaN if the facet does not exist.
  FacetPlane plane(const Facet& facet) const noexcept;

  /// Returns the unit normal of a facet's plane in D, pointing up.
  glm::dvec3 normal(const FacetPlane& plane) const noexcept;

  /// Returns how far the ray is above the surface at t metres along it, metres; NaN over holes.
  /// Over the rim the outermost facets go on.
  double clearance_m(const GridRay& ray, double t_m) const noexcept;

  /// Returns the first crossing from above in [t_begin_m, t_end_m], decided facet by facet in
  /// double: along the ray the surface is linear between crossings of the lines u, v and u+v =
  /// whole number. Crossings from below are none.
  std::optional<Crossing> first_crossing(const GridRay& ray, double t_begin_m,
                                         double t_end_m) const noexcept;

  /// Returns the part [t_begin_m, t_end_m] of the ray over the grid's rectangle, within [0, far_m];
  /// nothing if there is none.
  std::optional<glm::dvec2> overlap(const GridRay& ray, double far_m) const noexcept;

 private:
  glm::ivec2 size_;
  glm::dvec2 origin_m_;
  glm::dvec2 step_m_;
  glm::dvec2 cells_per_m_;
  std::shared_ptr<const std::vector<float>> heights_m_;
  const float* samples_;
  double min_height_m_ = std::numeric_limits<double>::quiet_NaN();
  double max_height_m_ = std::numeric_limits<double>::quiet_NaN();
  std::size_t hole_count_ = 0;
};

/// Narrows [begin_m, end_m] to where start + t slope lies in [low, high]; leaves it empty (begin >
/// end) if nowhere.
inline void clip_range(double start, double slope, double low, double high, double& begin_m,
                       double& end_m) noexcept {
  if (slope == 0) {
    if (start < low || high < start) end_m = -std::numeric_limits<double>::infinity();
    return;
  }
  const double inverse = 1 / slope;
  const double a = (low - start) * inverse;
  const double b = (high - start) * inverse;
  begin_m = std::max(begin_m, std::min(a, b));
  end_m = std::min(end_m, std::max(a, b));
}

/// Returns where `ray` meets `plane`, metres along the ray; negative, infinite or NaN where it does
/// not.
inline double intersect(const GridRay& ray, const FacetPlane& plane) noexcept {
  const double above_m =
      ray.z0 - (plane.height_m + plane.u_slope_m * ray.u0 + plane.v_slope_m * ray.v0);
  return above_m / -(ray.dz - (plane.u_slope_m * ray.du + plane.v_slope_m * ray.dv));
}

inline FacetPlane HeightGrid::plane(const Facet& facet) const noexcept {
  const double east = height_m(facet.column + 1, facet.row);
  const double south = height_m(facet.column, facet.row + 1);
  const double column = facet.column;
  const double row = facet.row;
  double u_slope_m, v_slope_m, corner;
  if (facet.half == Facet::Half::Near) {
    const double apex = height_m(facet.column, facet.row);
    u_slope_m = east - apex;
    v_slope_m = south - apex;
    corner = apex;
  } else {
    const double apex = height_m(facet.column + 1, facet.row + 1);
    u_slope_m = apex - south;
    v_slope_m = apex - east;
    corner = east + south - apex;
  }
  return {corner - (u_slope_m * column + v_slope_m * row), u_slope_m, v_slope_m};
}

}  // namespace groundray
