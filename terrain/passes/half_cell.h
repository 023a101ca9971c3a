#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>

#include "terrain/passes/cell_plane.h"
#include "terrain/passes/heights.h"
#include "terrain/passes/level_grid.h"
#include "terrain/passes/thin.h"

namespace groundray::passes {

/// Rows of samples to look at, and rows of the DEM's cells below them; both begin with `begin`.
struct Band {
  int begin = 0;
  int end = 0;
  int cell_end = 0;
};

/// Returns the larger of `worst` and the largest |start + x slope - scale heights[x]| for begin <=
/// x < end; samples that are missing do not count.
inline double worst_in_row(const float* heights, int begin, int end, double start, double slope,
                           double scale, double worst) noexcept {
#pragma omp simd reduction(max : worst)
  for (int x = begin; x < end; ++x) {
    const double distance = std::abs(start + x * slope - scale * heights[x]);
    worst = distance > worst ? distance : worst;
  }
  return worst;
}

/// One half of a cell against the samples in it, and its diagonal against the edges that it
/// crosses. Its other two sides lie on edges of the DEM's.
struct HalfCell {
  const Heights& samples;
  const CellShape& shape;
  glm::ivec2 first;  ///< the cell's north-western sample
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

  // Cells whose sides are no powers of two, or whose corners are interpolated unevenly: multiplied
  // through by all denominators, so that whole numbers stay whole.
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
      worst = worst_in_row(samples.at(first.x, first.y + dy), std::max(begin, x_begin),
                           std::min(end, x_end), plane.start + dy * plane.slope_y, plane.slope_x,
                           scale, worst);
    }
    return worst;
  }

  // Leaves the part [begin, end) of a row that lies in the half.
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

  // The main diagonal of a regular cell meets the DEM's diagonals in the middle of cells.
  double along_regular_main(const Corners& at) const noexcept {
    const int begin = std::max({0, band.begin - first.y, samples.first.x - first.x});
    const int end = std::min(
        {shape.width, band.cell_end - first.y, samples.first.x + samples.size.x - 1 - first.x});
    const double slope = (at[SouthEast] - at[NorthWest]) * shape.per_width * 0.5;
    return worst_of_main_diagonal(samples.at(first.x, first.y), samples.row_stride, begin, end,
                                  at[NorthWest], slope, 0.5 * at.factor);
  }

  // A diagonal of any other cell meets the DEM's rows, columns and diagonals: at `i / count` of its
  // length, where one coordinate is whole and the other a fraction of `count` parts.
  double along_diagonal(bool is_anti, const Corners& at) const noexcept {
    const std::int64_t w = shape.width;
    const std::int64_t h = shape.height;
    const double from = is_anti ? at[NorthEast] : at[NorthWest];
    const double to = is_anti ? at[SouthWest] : at[SouthEast];
    const auto mesh = [&](std::int64_t i, std::int64_t count) {
      return from * static_cast<double>(count - i) + to * static_cast<double>(i);
    };
    double worst = 0;
    for (std::int64_t i = 1; i < h; ++i) {
      const std::int64_t x = w * (is_anti ? h - i : i);
      const Edge row{x / h, i, 1, 0};
      worst = larger(worst, crossing(row, x % h, h, mesh(i, h), at.factor) * shape.per_height);
    }
    for (std::int64_t i = 1; i < w; ++i) {
      const std::int64_t y = h * i;
      const Edge column{is_anti ? w - i : i, y / w, 0, 1};
      worst = larger(worst, crossing(column, y % w, w, mesh(i, w), at.factor) * shape.per_width);
    }
    const std::int64_t count = is_anti ? std::abs(h - w) : h + w;
    const double per_count = is_anti ? shape.per_difference : shape.per_sum;
    for (std::int64_t i = 1; i < count; ++i) {  // where x + y is whole
      const std::int64_t x = w * (is_anti ? count - i : i);
      const std::int64_t sum = is_anti ? w + (h > w ? i : -i) : i;
      const Edge diagonal{x / count, sum - x / count, 1, -1};
      worst = larger(worst,
                     crossing(diagonal, x % count, count, mesh(i, count), at.factor) * per_count);
    }
    return worst;
  }

  /// An edge of the DEM's, from sample (x, y) of the cell to (x + dx, y + dy).
  struct Edge {
    std::int64_t x, y;
    int dx, dy;
  };

  // Returns how far the mesh, at height `mesh / (count factor)`, lies from `part / count` of the
  // way along the edge, times `count factor`.
  double crossing(const Edge& edge, std::int64_t part, std::int64_t count, double mesh,
                  int factor) const noexcept {
    if (part == 0) return 0;  // a sample
    const int column = first.x + static_cast<int>(edge.x);
    const int row = first.y + static_cast<int>(edge.y);
    if (column < samples.first.x || column + edge.dx >= samples.first.x + samples.size.x) return 0;
    const int upper_row = std::min(row, row + edge.dy);
    if (upper_row < band.begin || upper_row >= (edge.dy == 0 ? band.end : band.cell_end)) return 0;
    const double here = *samples.at(column, row);
    const double there = *samples.at(column + edge.dx, row + edge.dy);
    const double reference =
        here * static_cast<double>(count - part) + there * static_cast<double>(part);
    return larger(0, std::abs(mesh - factor * reference));
  }
};

}  // namespace groundray::passes
