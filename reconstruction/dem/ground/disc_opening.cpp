#include "reconstruction/dem/ground/disc_opening.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace groundray {
namespace {

struct Lowest {
  static constexpr float none = std::numeric_limits<float>::infinity();
  static float of(float a, float b) noexcept { return b < a ? b : a; }
};

struct Highest {
  static constexpr float none = -std::numeric_limits<float>::infinity();
  static float of(float a, float b) noexcept { return a < b ? b : a; }
};

// Extremes of all runs of 2^k cells of one row, for k = 0, 1, ...: run i of level k begins at cell
// i - margin. The extreme of any run is that of two overlapping ones of these.
template <typename Extreme>
class RowRuns {
 public:
  RowRuns(int columns, int margin)
      : length_(static_cast<std::size_t>(columns) + 2 * static_cast<std::size_t>(margin)),
        margin_(static_cast<std::size_t>(margin)),
        levels_(static_cast<std::size_t>(std::bit_width(2 * margin_ + 1))),
        runs_(length_ * levels_, Extreme::none) {}

  void fill(const float* row) noexcept {
    std::copy_n(row, length_ - 2 * margin_, runs_.data() + margin_);
    for (std::size_t k = 1; k < levels_; ++k) {
      const std::size_t half = std::size_t{1} << (k - 1);
      const float* from = runs_.data() + (k - 1) * length_;
      float* to = runs_.data() + k * length_;
      for (std::size_t i = 0; i + half < length_; ++i) to[i] = Extreme::of(from[i], from[i + half]);
    }
  }

  // Merges into each cell of `into` the extreme of the cells at most `reach` columns away.
  void merge(int reach, float* into) const noexcept {
    const auto width = 2 * static_cast<std::size_t>(reach) + 1;
    const auto level = static_cast<std::size_t>(std::bit_width(width) - 1);
    const float* first = runs_.data() + level * length_ + margin_ - static_cast<std::size_t>(reach);
    const float* second = first + width - (std::size_t{1} << level);
    const std::size_t columns = length_ - 2 * margin_;
    for (std::size_t i = 0; i < columns; ++i)
      into[i] = Extreme::of(into[i], Extreme::of(first[i], second[i]));
  }

 private:
  std::size_t length_, margin_, levels_;
  std::vector<float> runs_;
};

// Returns the half-width of the disc in each row, by the row's distance from the centre.
std::vector<int> half_widths(int radius) {
  std::vector<int> widths;
  for (int dy = 0; dy <= radius; ++dy) {
    int width = 0;
    while ((width + 1) * (width + 1) + dy * dy <= radius * radius) ++width;
    widths.push_back(width);
  }
  return widths;
}

template <typename Extreme>
Raster extremes(const Raster& surface, const std::vector<int>& widths) {
  const int radius = static_cast<int>(widths.size()) - 1;
  Raster result(surface.size, Extreme::none);
  const int strip = std::max(32, 2 * radius);
  const int strips = (surface.size.y + strip - 1) / strip;
  tbb::parallel_for(0, strips, [&](int number) {
    RowRuns<Extreme> runs(surface.size.x, radius);
    const int begin = number * strip, end = std::min(begin + strip, surface.size.y);
    for (int y = std::max(0, begin - radius); y < std::min(surface.size.y, end + radius); ++y) {
      runs.fill(surface.row(y));
      for (int to = std::max(begin, y - radius); to < std::min(end, y + radius + 1); ++to)
        runs.merge(widths[static_cast<std::size_t>(std::abs(to - y))], result.row(to));
    }
  });
  return result;
}

}  // namespace

Raster opened_by_disc(const Raster& surface, int radius_cells) {
  const std::vector<int> widths = half_widths(radius_cells);
  return extremes<Highest>(extremes<Lowest>(surface, widths), widths);
}

Raster closed_by_disc(const Raster& surface, int radius_cells) {
  const std::vector<int> widths = half_widths(radius_cells);
  return extremes<Lowest>(extremes<Highest>(surface, widths), widths);
}

}  // namespace groundray
