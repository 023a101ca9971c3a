#pragma once

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>

namespace groundray {

/// A ray in grid coordinates: at t metres along it, u = u0 + t du (columns), v = v0 + t dv (rows)
/// and z = z0 + t dz (metres).
struct GridRay {
  double u0 = 0, v0 = 0, z0 = 0;
  double du = 0, dv = 0, dz = 0;
};

/// Plane of a facet over grid coordinates: z = height_m + u_slope_m u + v_slope_m v; slopes in
/// metres per cell.
struct FacetPlane {
  double height_m = 0;
  double u_slope_m = 0;
  double v_slope_m = 0;
};

/// Positions of a DEM's samples: sample (column, row) is at origin_m + (column, row) * step_m in
/// the horizontal plane of D.
struct GridFrame {
  glm::ivec2 samples{2};  ///< columns and rows, each at least 2
  glm::dvec2 origin_m{0};
  glm::dvec2 step_m{1};       ///< components may be negative: rasters run north to south
  glm::dvec2 cells_per_m{1};  ///< 1 / step_m

  /// Returns the grid coordinates of `p` (D, metres): fractional column and row.
  glm::dvec2 to_grid(glm::dvec2 p) const noexcept { return (p - origin_m) * cells_per_m; }

  /// Returns the ray from `origin` along the unit vector `direction`, both in D.
  GridRay to_grid(const glm::dvec3& origin, const glm::dvec3& direction) const noexcept {
    const glm::dvec2 at = to_grid(glm::dvec2(origin));
    return {at.x,       at.y, origin.z, direction.x * cells_per_m.x, direction.y * cells_per_m.y,
            direction.z};
  }

  /// Returns the position of a sample in D.
  glm::dvec2 to_D(glm::ivec2 sample) const noexcept {
    return origin_m + glm::dvec2(sample) * step_m;
  }

  /// Returns the unit normal of a facet's plane in D, pointing up.
  glm::dvec3 normal(const FacetPlane& plane) const noexcept {
    return glm::normalize(
        glm::dvec3(-plane.u_slope_m * cells_per_m.x, -plane.v_slope_m * cells_per_m.y, 1));
  }
};

/// Clips [begin_m, end_m] to the t for which start + t slope lies in [low, high]; empty (begin >
/// end) if there are none.
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

/// Returns the height of the ray above `plane` at t metres along it, metres.
inline double clearance_m(const GridRay& ray, const FacetPlane& plane, double t_m) noexcept {
  const double u = ray.u0 + t_m * ray.du;
  const double v = ray.v0 + t_m * ray.dv;
  return ray.z0 + t_m * ray.dz - (plane.height_m + plane.u_slope_m * u + plane.v_slope_m * v);
}

/// Returns the range at which `ray` intersects `plane`, metres; negative, infinite or NaN if it
/// does not.
inline double intersect(const GridRay& ray, const FacetPlane& plane) noexcept {
  const double above_m =
      ray.z0 - (plane.height_m + plane.u_slope_m * ray.u0 + plane.v_slope_m * ray.v0);
  return above_m / -(ray.dz - (plane.u_slope_m * ray.du + plane.v_slope_m * ray.dv));
}

}  // namespace groundray
