#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/tracing/ground_facet.h"
#include "core/tracing/passes/facet_hit.h"
#include "core/tracing/passes/level_view.h"

namespace groundray {

/// Walk of a ray along one axis of a block of cells, each 2^exponent cells of the DEM wide except
/// for the last, from grid line to grid line.
struct AxisWalk {
  double start = 0, slope = 0, per_m = 0;  ///< of the ray: grid coordinate, its slope, 1 / slope
  int first = 0, last = 0;                 ///< samples of the DEM
  int exponent = 0;
  int count = 0;  ///< number of cells
  int at = 0;     ///< cell that the ray is in

  /// Moves to the cell of a range; returns false if the ray runs beside the block.
  /// @param along  cell of the DEM that the ray runs along, if its slope is 0.
  bool begin(double t_m, int along) noexcept {
    if (std::isinf(per_m)) {
      at = (along - first) >> exponent;
      return first <= along && along < last;
    }
    const double place = std::min(std::max(start + t_m * slope, static_cast<double>(first)),
                                  static_cast<double>(last - 1));
    at = (static_cast<int>(place) - first) >> exponent;
    // Rounding may have placed it one cell off.
    const int ahead = per_m > 0 ? 1 : -1;
    while (is_inside(at - ahead) && line_m(per_m > 0 ? at : at + 1) > t_m) at -= ahead;
    while (is_inside(at + ahead) && exit_m() <= t_m) at += ahead;
    return true;
  }
  bool is_inside(int cell) const noexcept { return 0 <= cell && cell < count; }
  /// Returns the range at which the ray crosses the line before a cell.
  double line_m(int cell) const noexcept {
    return (std::min(first + (cell << exponent), last) - start) * per_m;
  }
  double exit_m() const noexcept {
    return std::isinf(per_m) ? facet_hit::never_m : line_m(per_m > 0 ? at + 1 : at);
  }
  void advance() noexcept { at += per_m > 0 ? 1 : -1; }
};

/// Calls `act(column, row, part)` for the cells of a block that a ray passes within a part, in
/// order, until it returns true.
/// @param first,last  samples of the DEM at the block's corners.
/// @param count       columns and rows of cells.
template <typename Act>
void walk_block(const FacetRay& ray, const RayPart& part, glm::ivec2 first, glm::ivec2 last,
                int exponent, glm::ivec2 count, const Act& act) noexcept {
  AxisWalk columns{ray.grid.u0, ray.grid.du, ray.per_column_m, first.x, last.x, exponent, count.x};
  AxisWalk rows{ray.grid.v0, ray.grid.dv, ray.per_row_m, first.y, last.y, exponent, count.y};
  if (part.is_empty() || !columns.begin(part.in_m, ray.cell.x) ||
      !rows.begin(part.in_m, ray.cell.y)) {
    return;
  }
  for (double t_m = part.in_m;;) {
    const double column_exit_m = columns.exit_m(), row_exit_m = rows.exit_m();
    const double leave_m = std::max(t_m, std::min(column_exit_m, row_exit_m));
    if (act(columns.at, rows.at, RayPart{t_m, std::min(leave_m, part.out_m)}) ||
        !(leave_m < part.out_m)) {
      return;
    }
    AxisWalk& crossed = column_exit_m <= row_exit_m ? columns : rows;
    crossed.advance();
    if (!crossed.is_inside(crossed.at)) return;
    t_m = leave_m;
  }
}

/// First hit of a ray on the ground, from above.
struct Crossing {
  double range_m = std::numeric_limits<double>::infinity();  ///< infinite without a hit
  FacetPlane plane;
  float deviation_m = 0;
  GroundFacet facet;
};

/// Replaces `best` by the hit of a ray on a cell if that is nearer. Of hits at equal ranges, the
/// one on the first facet counts: finer levels first, each row by row, near halves first.
inline void hit_cell(const FacetRay& ray, const Cell& cell, const Leaf& leaf, std::uint32_t level,
                     Crossing& best) noexcept {
  const FacetHit hit = hit_cell(ray, cell);
  if (!(hit.range_m <= best.range_m) || std::isinf(hit.range_m)) return;
  const GroundFacet facet{level, cell.column, cell.row, hit.half};
  const GroundFacet& other = best.facet;
  const bool is_first = facet.level != other.level     ? facet.level < other.level
                        : facet.row != other.row       ? facet.row < other.row
                        : facet.column != other.column ? facet.column < other.column
                                                       : facet.half < other.half;
  if (hit.range_m < best.range_m || is_first)
    best = {hit.range_m, hit.plane, leaf.deviation_m, facet};
}

/// Replaces `best` by the first hit of a ray on the cells [begin, end) of a leaf, within a part of
/// the ray over them, if that is nearer.
inline void hit_cells(const FacetRay& ray, const RayPart& part, const LeafCells& cells,
                      glm::ivec2 begin, glm::ivec2 end, std::uint32_t level,
                      Crossing& best) noexcept {
  const glm::ivec2 first{cells.column(begin.x), cells.row(begin.y)};
  const glm::ivec2 last{cells.column(end.x), cells.row(end.y)};
  walk_block(ray, part, first, last, cells.exponent, {end.x - begin.x, end.y - begin.y},
             [&](int column, int row, const RayPart& over) {
               if (over.in_m > best.range_m) return true;
               hit_cell(ray, cells.cell(begin.x + column, begin.y + row), cells.leaf, level, best);
               return false;
             });
}

/// Replaces `best` by the first hit of a ray on the cells [begin, end) of a leaf, if that is
/// nearer.
inline void hit_cells(const FacetRay& ray, const LeafCells& cells, glm::ivec2 begin, glm::ivec2 end,
                      std::uint32_t level, Crossing& best) noexcept {
  const glm::ivec2 first{cells.column(begin.x), cells.row(begin.y)};
  const glm::ivec2 last{cells.column(end.x), cells.row(end.y)};
  hit_cells(ray, part_over(ray, first, {last.x - first.x, last.y - first.y}), cells, begin, end,
            level, best);
}

}  // namespace groundray
