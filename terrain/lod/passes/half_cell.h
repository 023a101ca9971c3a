#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>

#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/border_thinning.h"
#include "terrain/lod/passes/cell_plane.h"
#include "terrain/lod/passes/level_grid.h"

namespace groundray::passes {

/// Rows of samples to evaluate, and rows of the DEM's cells below them; both begin with `begin`.
struct Band {
  int begin = 0;
  int end = 0;
  int cell_end = 0;
};

/// Returns the larger of `worst` and the largest |start + x slope - scale height| over the samples
/// begin <= x < end of a row; `heights` is the first of these. Missing samples are ignored.
inline double worst_in_row(const float* heights, int begin, int end, double start, double slope,
                           double scale, double worst) noexcept {
#pragma omp simd reduction(max : worst)
  for (int x = begin; x < end; ++x) {
    const double distance = std::abs(start + x * slope - scale * heights[x - begin]);
    worst = distance > worst ? distance : worst;
  }
  return worst;
}

/// Comparison of one half of a cell with the samples in it, and of its diagonal with the edges that
/// it crosses. The half's other two sides lie on edges of the DEM.
struct HalfCell {
  const HeightWindow& samples;
  const CellShape& shape;
  glm::ivec2 first;  ///< north-western sample of the cell
  Band band;

  /// Returns the largest vertical distance, metres; 0 for a half that does not exist.
  double deviation(Corner half, const Corners& at) const noexcept {
    if (!exists(half, at)) return 0;
    const double inside =
        shape.is_regular && at.factor == 1
            ? over_samples(half, plane_of(half, at, shape.per_width, shape.per_height), 1)
            : over_scaled_samples(half, at);
    const bool is_anti = is_of_anti_diagonal(half);
    if (is_anti && shape.is_regular) return inside;
    const double crossed = shape.is_regular ? along_regular_main(at) : along_diagonal(is_anti, at);
    return larger(inside, crossed * at.per_factor);
  }

  // For cells whose sides are not powers of two, or whose corners are interpolated unevenly: all
  // terms are multiplied by all denominators, so that integers stay integers.
  double over_scaled_samples(Corner half, const Corners& at) const noexcept {
    const double area = static_cast<double>(shape.width) * shape.height;
    Plane plane = plane_of(half, at, shape.height, shape.width);
    plane.start *= area;
    return over_samples(half, plane, at.factor * area) * (shape.per_area * at.per_factor);
  }

  double over_samples(Corner half, const Plane& plane, double scale) const noexcept {
    const int dy_end = std::min(shape.height + 1, band.end - first.y);
    const int x_begin = samples.first.x - first.x;
    const int x_end = x_begin + samples.size.x;
    double worst = 0;
    for (int dy = std::max(0, band.begin - first.y); dy < dy_end; ++dy) {
      int begin = 0;
      int end = shape.width + 1;
      narrow(half, dy, begin, end);
      begin = std::max(begin, x_begin);
      end = std::min(end, x_end);
      if (begin >= end) continue;
      worst = worst_in_row(samples.at(first.x + begin, first.y + dy), begin, end,
                           plane.start + dy * plane.slope_y, plane.slope_x, scale, worst);
    }
    return worst;
  }

  // Narrows [begin, end) to the part of a row that lies in the half.
  void narrow(Corner half, int dy, int& begin, int& end) const noexcept {
    const bool is_anti = is_of_anti_diagonal(half);
    const std::int64_t along = is_anti ? shape.height - dy : dy;
    const auto steps = [&](std::int64_t remainder) {
      return shape.is_regular ? static_cast<int>(along)
                              : static_cast<int>((along * shape.width + remainder) / shape.height);
    };
    if (half == NorthWest || half == SouthWest) {
      end = steps(0) + 1;
    } else {
      begin = steps(shape.height - 1);
    }
  }

  // The main diagonal of a regular cell crosses the DEM's diagonals at the centres of cells.
  double along_regular_main(const Corners& at) const noexcept {
    const int begin = std::max({0, band.begin - first.y, samples.first.x - first.x});
    const int end = std::min(
        {shape.width, band.cell_end - first.y, samples.first.x + samples.size.x - 1 - first.x});
    if (begin >= end) return 0;
    const double slope = (at[SouthEast] - at[NorthWest]) * shape.per_width * 0.5;
    return worst_of_main_diagonal(samples.at(first.x + begin, first.y + begin), samples.row_stride,
                                  begin, end, at[NorthWest], slope, 0.5 * at.factor);
  }

  /// Position on an edge of the DEM that runs from sample (x, y) of the cell to (x + dx, y + dy):
  /// `part` of `count` parts of the way.
  struct EdgePlace {
    std::int64_t x, y;
    int dx, dy;
    std::int64_t part, count;
  };

  // A diagonal of any other cell crosses the DEM's rows, columns and diagonals.
  double along_diagonal(bool is_anti, const Corners& at) const noexcept {
    const std::int64_t w = shape.width;
    const std::int64_t h = shape.height;
    const auto column_at = [&](std::int64_t i, std::int64_t count) {  // times count
      return w * (is_anti ? count - i : i);
    };
    const double by_rows = walk(is_anti, at, h, [&](std::int64_t i) -> EdgePlace {
      const std::int64_t x = column_at(i, h);
      return {x / h, i, 1, 0, x % h, h};
    });
    const double by_columns = walk(is_anti, at, w, [&](std::int64_t i) -> EdgePlace {
      return {is_anti ? w - i : i, h * i / w, 0, 1, h * i % w, w};
    });
    const std::int64_t count = is_anti ? std::abs(h - w) : h + w;
    const double by_diagonals = walk(is_anti, at, count, [&](std::int64_t i) -> EdgePlace {
      const std::int64_t x = column_at(i, count);
      const std::int64_t sum = is_anti ? w + (h > w ? i : -i) : i;  // x + y, an integer
      return {x / count, sum - x / count, 1, -1, x % count, count};
    });
    return larger(larger(by_rows * shape.per_height, by_columns * shape.per_width),
                  by_diagonals * (is_anti ? shape.per_difference : shape.per_sum));
  }

  // Walks along a diagonal in `count` steps, as far as they may be in the band. Returns `count`
  // times the largest distance from the edges of the DEM that `place_at` returns for each step.
  template <typename PlaceAt>
  double walk(bool is_anti, const Corners& at, std::int64_t count,
              const PlaceAt& place_at) const noexcept {
    const double from = is_anti ? at[NorthEast] : at[NorthWest];
    const double to = is_anti ? at[SouthWest] : at[SouthEast];
    const std::int64_t above = std::max(0, band.begin - first.y - 1);
    const std::int64_t below = std::max(0, band.end - first.y + 1);
    const std::int64_t end = std::min(count, below * count / shape.height + 1);
    double worst = 0;
    for (std::int64_t i = std::max<std::int64_t>(1, above * count / shape.height); i < end; ++i) {
      const double mesh = from * static_cast<double>(count - i) + to * static_cast<double>(i);
      worst = larger(worst, crossing(place_at(i), mesh, at.factor));
    }
    return worst;
  }

  // Returns the distance between the mesh, at height `mesh / (count factor)`, and a position on an
  // edge, times `count factor`; 0 for edges that are not in the window or the band.
  double crossing(const EdgePlace& edge, double mesh, int factor) const noexcept {
    if (edge.part == 0) return 0;  // a sample
    const int column = first.x + static_cast<int>(edge.x);
    const int row = first.y + static_cast<int>(edge.y);
    if (column < samples.first.x || column + edge.dx >= samples.first.x + samples.size.x) return 0;
    const int upper_row = std::min(row, row + edge.dy);
    if (upper_row < band.begin || upper_row >= (edge.dy == 0 ? band.end : band.cell_end)) return 0;
    const double here = *samples.at(column, row);
    const double there = *samples.at(column + edge.dx, row + edge.dy);
    const double reference =
        here * static_cast<double>(edge.count - edge.part) + there * static_cast<double>(edge.part);
    return larger(0, std::abs(mesh - factor * reference));
  }
};

}  // namespace groundray::passes
