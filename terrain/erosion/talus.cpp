// Samples that are too steep wait in a queue. Each exchanges material with each lower neighbour,
// down to a slope slightly below the limit: every exchange then moves at least a fixed amount, so
// that the queue ends. Means over blocks of 2 x 2 samples slide first, so that material travels far
// in few exchanges; where means are too steep, so are samples.
#include "terrain/erosion/talus.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <vector>

#include "core/error.h"

namespace groundray {
namespace {

constexpr double settled = 0.999;   // slope after an exchange / limit
constexpr double trigger = 0.9998;  // slope above which there is one / limit; below 1 for rounding
constexpr int least_samples = 8;    // side of the coarsest grid
constexpr std::size_t most_exchanges = 3'000;  // of a sample, on average

// Slope up to which ground is left alone, and what rounding of the heights to float may add.
struct Limit {
  double slope, rounding_m;
};

// Heights of samples that stand for areas.
struct Layer {
  SampleGrid grid;
  std::vector<double> heights_m, areas;  // areas in samples of the finest grid
};

// Returns the means over blocks of 2 x 2 samples; NaN where one of them is, as the mean of the
// others is that of another place.
Layer coarsened(const SampleGrid& grid, std::span<const double> heights_m,
                std::span<const double> areas) {
  Layer coarse{{(grid.size + 1) / 2, grid.step_m * 2.0}, {}, {}};
  coarse.heights_m.resize(coarse.grid.count());
  coarse.areas.resize(coarse.grid.count());
  for (std::size_t i = 0; i < grid.count(); ++i) {
    coarse.heights_m[grid.block(i)] += heights_m[i] * areas[i];
    coarse.areas[grid.block(i)] += areas[i];
  }
  for (std::size_t i = 0; i < coarse.grid.count(); ++i) coarse.heights_m[i] /= coarse.areas[i];
  return coarse;
}

void settle(const SampleGrid& grid, const Limit& most, std::span<const double> areas,
            std::span<double> heights_m) {
  std::deque<std::uint32_t> open;
  std::vector<bool> waits(grid.count());
  const auto wait = [&](std::size_t at) {
    if (waits[at]) return;
    waits[at] = true;
    open.push_back(static_cast<std::uint32_t>(at));
  };
  const auto is_steep = [&](std::size_t from, std::size_t to, double distance_m) {
    return heights_m[from] - heights_m[to] > trigger * most.slope * distance_m - most.rounding_m;
  };
  for (std::size_t i = 0; i < grid.count(); ++i) {
    grid.each_neighbour(i, [&](std::size_t next, double distance_m) {
      if (is_steep(i, next, distance_m)) wait(i);
    });
  }
  std::size_t exchanges = 0;
  while (!open.empty()) {
    if (exchanges > most_exchanges * grid.count()) {
      throw Error(
          "erosion: the ground has not come to rest after {} exchanges; its slopes are far above "
          "talus_deg: make that larger, or uplift smaller",
          exchanges);
    }
    const std::uint32_t at = open.front();
    open.pop_front();
    waits[at] = false;
    bool has_slid = false;
    grid.each_neighbour(at, [&](std::size_t next, double distance_m) {
      if (!is_steep(at, next, distance_m)) return;
      const double excess_m =
          heights_m[at] - heights_m[next] - settled * most.slope * distance_m + most.rounding_m;
      const double both = areas[at] + areas[next];
      heights_m[at] -= excess_m * areas[next] / both;
      heights_m[next] += excess_m * areas[at] / both;
      has_slid = true;
      ++exchanges;
      wait(next);
    });
    if (!has_slid) continue;
    // It is lower now: its higher neighbours may have become too steep.
    grid.each_neighbour(at, [&](std::size_t next, double distance_m) {
      if (is_steep(next, at, distance_m)) wait(next);
      if (is_steep(at, next, distance_m)) wait(at);
    });
  }
}

void slide(const SampleGrid& grid, const Limit& most, std::span<const double> areas,
           std::span<double> heights_m) {
  if (std::min(grid.size.x, grid.size.y) >= 2 * least_samples) {
    Layer coarse = coarsened(grid, heights_m, areas);
    const std::vector<double> before_m = coarse.heights_m;
    slide(coarse.grid, most, coarse.areas, coarse.heights_m);
    for (std::size_t i = 0; i < grid.count(); ++i) {
      const double change_m = coarse.heights_m[grid.block(i)] - before_m[grid.block(i)];
      if (!std::isnan(change_m)) heights_m[i] += change_m;
    }
  }
  settle(grid, most, areas, heights_m);
}

}  // namespace

void let_slide(const SampleGrid& grid, double most_slope, std::span<double> heights_m) {
  double highest_m = 0;
  for (const double height_m : heights_m)
    if (std::abs(height_m) > highest_m) highest_m = std::abs(height_m);
  const Limit most{most_slope, highest_m * 0x1p-23};
  const double step_m = std::min(grid.step_m.x, grid.step_m.y);
  if (most.rounding_m > 0.1 * most_slope * step_m) {
    throw Error(
        "erosion: heights up to {:g} m are too coarse, as floats, for slopes between samples {:g} "
        "m "
        "apart; subtract a height from the DEM, or make uplift smaller",
        highest_m, step_m);
  }
  slide(grid, most, std::vector<double>(grid.count(), 1), heights_m);
}

}  // namespace groundray
