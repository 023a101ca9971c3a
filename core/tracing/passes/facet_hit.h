#pragma once

// Decision, in double, whether a ray hits a facet of the ground. It depends on the ray and on the
// facet's cell alone, and not on how the facet was found. All tracers share it, those on devices
// too, so that their results are equal to the last bit (docs/theory/surface.md).

#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>
#include <limits>

#include "core/geometry/cell.h"
#include "core/geometry/grid_frame.h"

namespace groundray {

/// Window of the outermost level, and what counts as steep in its grid.
struct GroundExtent {
  glm::ivec2 first{0}, last{0};  ///< samples of the DEM at its corners
  double steep_m = 0;            ///< rise by 8 times the width of a cell, metres per cell

  GroundExtent() = default;
  GroundExtent(const GridFrame& frame, glm::ivec2 from, glm::ivec2 to) noexcept
      : first(from),
        last(to),
        steep_m(8 * std::max(std::abs(frame.step_m.x), std::abs(frame.step_m.y))) {}
};

/// A ray in grid coordinates, prepared for decisions.
struct FacetRay {
  GridRay grid;  ///< components below 1e-290 are 0, as on processors that flush small numbers
  double begin_m = 0, far_m = 0;  ///< hits before and beyond them are ignored
  double per_column_m = 0;        ///< metres along the ray from one column to the next: 1 / du;
                                  ///< infinite if the ray runs along a column
  double per_row_m = 0;
  glm::ivec2 cell{0};  ///< column and row of the cells that the ray runs along; -1 outside
  double steep_m = 0;  ///< GroundExtent::steep_m

  FacetRay() = default;
  FacetRay(const GridRay& ray, const GroundExtent& ground, double begin, double far) noexcept
      : grid{ray.u0, ray.v0, ray.z0, flushed(ray.du), flushed(ray.dv), flushed(ray.dz)},
        begin_m(begin),
        far_m(far),
        per_column_m(1 / grid.du),
        per_row_m(1 / grid.dv),
        cell(cell_along(ray.u0, ground.first.x, ground.last.x),
             cell_along(ray.v0, ground.first.y, ground.last.y)),
        steep_m(ground.steep_m) {
    if (std::isnan(ray.u0 + ray.v0 + ray.du + ray.dv))
      far_m = -std::numeric_limits<double>::infinity();  // it hits nothing
  }

  /// Returns what rounding may add to a clearance at t over a facet of this slope, metres per cell,
  /// several times over. The range of a grid line is rounded, too; so the ray may be beside it.
  double slack_m(double t_m, double slope_m) const noexcept {
    constexpr double rounding = 0x1p-48;  // 32 roundings of the largest term
    return rounding * (std::abs(grid.z0) + std::abs(t_m * grid.dz) +
                       slope_m * (std::abs(grid.u0) + std::abs(grid.v0) +
                                  std::abs(t_m) * (std::abs(grid.du) + std::abs(grid.dv))));
  }
  /// Slack that facets which are not steep have in common.
  double slack_m(double t_m) const noexcept { return slack_m(t_m, steep_m); }
  /// Largest slack of any facet: those yet steeper have no more.
  double largest_slack_m(double t_m) const noexcept { return slack_m(t_m, steepest * steep_m); }

  static constexpr double steepest = 64;

 private:
  static double flushed(double component) noexcept {
    return std::abs(component) < 1e-290 ? 0 : component;
  }
  // A ray that runs exactly along a line belongs to the cell after it, and to the last cell at the
  // end.
  static int cell_along(double start, int first, int last) noexcept {
    if (!(first <= start && start <= last)) return -1;
    return std::min(static_cast<int>(start), last - 1);
  }
};

/// Part of a ray, in metres along it; empty unless in_m < out_m.
struct RayPart {
  double in_m = 0, out_m = 0;

  bool is_empty() const noexcept { return !(in_m < out_m); }
};

/// Returns the part of a ray over whole cells of the DEM, `size` columns and rows from `first` on.
/// The ranges at which the ray crosses grid lines are functions of the ray and the line alone, so
/// that the parts over neighbours have no gap.
inline RayPart part_over(const FacetRay& ray, glm::ivec2 first, glm::ivec2 size) noexcept {
  RayPart part{ray.begin_m, ray.far_m};
  const auto narrow = [&part](double start, double per_m, int cell, int low, int count) {
    if (std::isinf(per_m)) {
      if (cell < low || cell >= low + count) part.out_m = part.in_m;
      return;
    }
    const double a_m = (low - start) * per_m, b_m = (low + count - start) * per_m;
    part.in_m = std::max(part.in_m, std::min(a_m, b_m));
    part.out_m = std::min(part.out_m, std::max(a_m, b_m));
  };
  narrow(ray.grid.u0, ray.per_column_m, ray.cell.x, first.x, size.x);
  narrow(ray.grid.v0, ray.per_row_m, ray.cell.y, first.y, size.y);
  return part;
}

/// Hit of a ray on one of the two facets of a cell.
struct FacetHit {
  double range_m = std::numeric_limits<double>::infinity();  ///< infinite without a hit
  Half half = Half::Near;
  FacetPlane plane;
};

namespace facet_hit {

inline constexpr double never_m = std::numeric_limits<double>::infinity();

/// Returns the range at which a ray hits a facet from above; infinite if it does not.
///
/// A facet counts only if the ray falls towards its plane. Where the ray passes from one facet to
/// the next, rounding makes the clearances over both differ. The ray therefore hits a facet unless
/// it leaves it surely above, so that it does not pass between two. At a vertex it may pass facets
/// so briefly that they only show rounding: these count if the ray was surely above before, so that
/// one that leaves the ground there hits none of them.
/// @param part  of the ray over the facet.
inline double hit_m(const FacetRay& ray, const FacetPlane& plane, const RayPart& part) noexcept {
  const GridRay& grid = ray.grid;
  const double rate = grid.dz - (plane.u_slope_m * grid.du + plane.v_slope_m * grid.dv);
  if (part.is_empty() || !(rate < 0)) return never_m;
  const double slope_m =
      std::min(std::max(ray.steep_m, std::abs(plane.u_slope_m) + std::abs(plane.v_slope_m)),
               FacetRay::steepest * ray.steep_m);
  const bool begins_over = part.in_m == ray.begin_m, ends_over = part.out_m == ray.far_m;
  const double in_m = clearance_m(grid, plane, part.in_m);
  if (!(in_m >= (begins_over ? 0 : -ray.slack_m(part.in_m, slope_m)))) return never_m;
  if (!std::isinf(part.out_m)) {
    const double out_m = clearance_m(grid, plane, part.out_m);
    const double rounding_m = begins_over ? 0 : 0.25 * ray.slack_m(part.in_m);
    const double falls_m = -rate * (part.out_m - part.in_m);
    if (!(out_m < (ends_over ? 0 : ray.slack_m(part.out_m, slope_m)))) return never_m;
    if (!(in_m >= rounding_m || falls_m > rounding_m)) return never_m;
  }
  return std::min(std::max(intersect(grid, plane), part.in_m), part.out_m);
}

}  // namespace facet_hit

/// Returns the first hit of a ray on the facets of a cell, from above.
inline FacetHit hit_cell(const FacetRay& ray, const Cell& cell) noexcept {
  const GridRay& grid = ray.grid;
  const RayPart part = part_over(ray, {cell.column, cell.row}, {cell.width, cell.height});
  if (part.is_empty()) return {};
  const double low_m = std::min(grid.z0 + part.in_m * grid.dz, grid.z0 + part.out_m * grid.dz) -
                       ray.slack_m(part.out_m);
  if (low_m > cell.nw && low_m > cell.ne && low_m > cell.sw && low_m > cell.se) return {};
  // The diagonal is where across + sign * down = offset.
  const bool is_anti = cell.split == Cell::Split::NorthEastToSouthWest;
  const double sign = is_anti ? 1 : -1, offset = is_anti ? 1 : 0;
  const double start =
      (grid.u0 - cell.column) / cell.width + sign * ((grid.v0 - cell.row) / cell.height);
  const double rate = grid.du / cell.width + sign * (grid.dv / cell.height);
  const bool begins_low = rate == 0 ? !(start > offset) : rate > 0;
  const double turn_m = rate == 0 ? part.out_m : (offset - start) / rate;
  const Half halves[2] = {begins_low == is_anti ? Half::Near : Half::Far,
                          begins_low == is_anti ? Half::Far : Half::Near};
  const RayPart parts[2] = {{part.in_m, std::min(turn_m, part.out_m)},
                            {std::max(turn_m, part.in_m), part.out_m}};
  for (int i = 0; i < 2; ++i) {
    const FacetPlane plane = cell.plane(halves[i]);
    const double range_m = facet_hit::hit_m(ray, plane, parts[i]);
    if (range_m < facet_hit::never_m) return {range_m, halves[i], plane};
  }
  return {};
}

}  // namespace groundray
