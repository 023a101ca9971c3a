#pragma once

#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>
#include <optional>

#include "core/geometry/cell.h"
#include "core/geometry/grid_frame.h"

namespace groundray {

/// Returns the height at `p` (D, metres) of a surface whose cells are those of the DEM; nothing
/// outside the DEM or in a hole.
/// @param cell_at  returns the cell whose first sample is (column, row).
template <typename CellAt>
std::optional<double> surface_height_m(const GridFrame& frame, glm::dvec2 p,
                                       const CellAt& cell_at) {
  const glm::dvec2 at = frame.to_grid(p);
  const glm::ivec2 last = frame.samples - 1;
  if (!(0 <= at.x && at.x <= last.x && 0 <= at.y && at.y <= last.y)) return std::nullopt;
  const Cell cell = cell_at(std::min(static_cast<int>(at.x), last.x - 1),
                            std::min(static_cast<int>(at.y), last.y - 1));
  const FacetPlane plane = cell.plane(cell.half_at(at.x, at.y));
  const double height_m = plane.height_m + plane.u_slope_m * at.x + plane.v_slope_m * at.y;
  return std::isnan(height_m) ? std::nullopt : std::optional(height_m);
}

}  // namespace groundray
