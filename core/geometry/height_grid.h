#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/cell.h"
#include "core/geometry/grid_frame.h"

namespace groundray {

/// Heights of a rectangle of samples, row by row; NaN if missing. Immutable; copies share the
/// samples; any number of threads may read one.
class HeightArray {
 public:
  /// @param size       columns and rows of samples, each at least 2.
  /// @param heights_m  size.x * size.y heights, row by row; NaN if missing.
  /// @throws Error if the sizes disagree or a height is infinite.
  HeightArray(glm::ivec2 size, std::vector<float> heights_m);

  glm::ivec2 size() const noexcept { return size_; }
  std::span<const float> heights_m() const noexcept { return *heights_m_; }
  float operator()(int column, int row) const noexcept {
    return samples_[static_cast<std::ptrdiff_t>(row) * size_.x + column];
  }

  /// Lowest and highest height, metres; NaN if every sample is a hole.
  double min_m() const noexcept { return min_m_; }
  double max_m() const noexcept { return max_m_; }
  /// Number of samples without a height.
  std::size_t hole_count() const noexcept { return hole_count_; }

 private:
  glm::ivec2 size_;
  std::shared_ptr<const std::vector<float>> heights_m_;
  const float* samples_;
  double min_m_ = std::numeric_limits<double>::quiet_NaN();
  double max_m_ = std::numeric_limits<double>::quiet_NaN();
  std::size_t hole_count_ = 0;
};

/// The reference surface: heights on a regular grid, connected by two triangles in each cell (see
/// Cell), split from sample (column+1, row) to sample (column, row+1). A NaN height is a hole:
/// triangles that touch it do not exist. Immutable; copies share the samples; any number of threads
/// may read one.
/// @see docs/theory/surface.md
class HeightGrid {
 public:
  /// @param size       columns and rows of samples, each at least 2.
  /// @param origin_m   position of sample (0, 0) in D, metres.
  /// @param step_m     from one sample to the next, metres; a component may be negative (rasters
  ///                   run north to south).
  /// @param heights_m  size.x * size.y heights, row by row; NaN if missing.
  /// @throws Error if the sizes disagree, a step is zero or not finite, or a height is infinite.
  HeightGrid(glm::ivec2 size, glm::dvec2 origin_m, glm::dvec2 step_m, std::vector<float> heights_m);

  int columns() const noexcept { return frame_.samples.x; }
  int rows() const noexcept { return frame_.samples.y; }
  glm::dvec2 origin_m() const noexcept { return frame_.origin_m; }
  glm::dvec2 step_m() const noexcept { return frame_.step_m; }
  const GridFrame& frame() const noexcept { return frame_; }
  const HeightArray& samples() const noexcept { return samples_; }
  std::span<const float> heights_m() const noexcept { return samples_.heights_m(); }
  float height_m(int column, int row) const noexcept { return samples_(column, row); }

  /// Lowest and highest height, metres; NaN if every sample is a hole.
  double min_height_m() const noexcept { return samples_.min_m(); }
  double max_height_m() const noexcept { return samples_.max_m(); }
  /// Number of samples without a height.
  std::size_t hole_count() const noexcept { return samples_.hole_count(); }

  /// Returns the surface's height at `p` (D, metres); nothing outside the grid or in a hole.
  std::optional<double> height_m_at(glm::dvec2 p) const noexcept;

  /// Returns the cell whose first sample is (column, row).
  Cell cell(int column, int row) const noexcept {
    return {column,
            row,
            1,
            1,
            height_m(column, row),
            height_m(column + 1, row),
            height_m(column, row + 1),
            height_m(column + 1, row + 1)};
  }

 private:
  GridFrame frame_;
  HeightArray samples_;
};

}  // namespace groundray
