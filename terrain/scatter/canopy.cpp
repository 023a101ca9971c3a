#include "terrain/scatter/canopy.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

#include "core/error.h"
#include "terrain/lod/pass.h"

namespace groundray {
namespace {

// Cells below crowns, with one more row or column on each side of nothing.
class CoveredCells {
 public:
  CoveredCells(std::span<const Crown> crowns, glm::ivec2 size, glm::dvec2 corner_m, double cell_m)
      : size_(size), sums_(row(size.y)) {
    const glm::ivec2 last = size - 1;
    for (const auto& [centre_m, radius_m] : crowns) {
      const glm::dvec2 centre = (centre_m - corner_m) / cell_m - 0.5;  // in cells
      const double radius = radius_m / cell_m;
      const double low = std::max(std::ceil(centre.y - radius), 0.0);
      const double high = std::min(std::floor(centre.y + radius), static_cast<double>(last.y));
      for (double y = low; y <= high; ++y) {
        const double half =
            std::sqrt(std::max(0.0, radius * radius - (y - centre.y) * (y - centre.y)));
        const double west = std::max(std::ceil(centre.x - half), 0.0);
        const double east = std::min(std::floor(centre.x + half), static_cast<double>(last.x));
        for (double x = west; x <= east; ++x)
          sums_[row(static_cast<int>(y)) + static_cast<std::size_t>(x) + 1] = 1;
      }
    }
    run_pass(run_in_parallel, static_cast<std::size_t>(size.y), [&](std::size_t y) {
      const std::size_t begin = row(static_cast<int>(y));
      for (std::size_t x = begin + 1; x <= begin + static_cast<std::size_t>(size_.x); ++x)
        sums_[x] += sums_[x - 1];
    });
  }

  // Returns how many cells [first, end) of a row are covered.
  std::uint32_t count(int y, int first, int end) const {
    return sums_[row(y) + static_cast<std::size_t>(end)] -
           sums_[row(y) + static_cast<std::size_t>(first)];
  }

 private:
  std::size_t row(int y) const {
    return static_cast<std::size_t>(y) * (static_cast<std::size_t>(size_.x) + 1);
  }

  glm::ivec2 size_;
  std::vector<std::uint32_t> sums_;  // of covered cells to the west, in each row
};

}  // namespace

Drape canopy_cover(std::span<const Crown> crowns, const Area& area, double cell_m, double radius_m,
                   std::size_t memory_bytes) {
  constexpr double bytes_per_cell = 14;  // sums, image and its mip levels
  const glm::dvec2 count = glm::max(glm::ceil((area.high_m - area.low_m) / cell_m), 1.0);
  const double bytes = count.x * count.y * bytes_per_cell;
  if (!(bytes <= static_cast<double>(memory_bytes))) {
    throw Error(
        "canopy: a grid of {:g} x {:g} cells takes {:g} MiB, more than the limit of {:g}; make its "
        "cell_m (now {:g}) larger, or allow more memory",
        count.x, count.y, bytes / (1 << 20), static_cast<double>(memory_bytes) / (1 << 20), cell_m);
  }
  constexpr double most_cells = 256;  // more take minutes
  if (radius_m > most_cells * cell_m) {
    throw Error(
        "canopy: radius_m = {:g} is more than {:g} cells of cell_m = {:g}; make cell_m larger",
        radius_m, most_cells, cell_m);
  }
  const glm::ivec2 size(count);
  const CoveredCells covered(crowns, size, area.low_m, cell_m);
  const double radius = radius_m / cell_m;
  const int reach = static_cast<int>(std::min(std::floor(radius), count.y));
  ImageF share(size.x, size.y, 1);
  run_pass(run_in_parallel, static_cast<std::size_t>(size.y), [&](std::size_t north) {
    const int y = size.y - 1 - static_cast<int>(north);
    for (int x = 0; x < size.x; ++x) {
      std::uint32_t below = 0, all = 0;
      for (int row = std::max(y - reach, 0); row <= std::min(y + reach, size.y - 1); ++row) {
        const double half = std::sqrt(radius * radius - (row - y) * (row - y));
        const int wide = static_cast<int>(std::min(std::floor(half), count.x));
        const int first = std::max(x - wide, 0), end = std::min(x + wide, size.x - 1) + 1;
        below += covered.count(row, first, end);
        all += static_cast<std::uint32_t>(end - first);
      }
      share.at(x, static_cast<int>(north))[0] =
          static_cast<float>(static_cast<double>(below) / all);
    }
  });
  return {Texture(std::move(share), Wrap::Clamp), area.low_m, count * cell_m};
}

}  // namespace groundray
