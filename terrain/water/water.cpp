#include "terrain/water/water.h"

// Hand-written in 200 lines: SAGA, which Debian has, brings 15 packages, and RichDEM is a package
// of Python alone.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/math.h"
#include "terrain/lod/pass.h"

namespace groundray {
namespace {

constexpr double least_slope = 0.001;  // of the index, where the ground is flat
constexpr double convergence = 1.1;    // exponent of slopes, Freeman (1991)
constexpr std::array<glm::ivec2, 8> neighbours{
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};

// Drainage of a grid. Its samples are numbered row by row within a frame of missing samples, so
// that each has eight neighbours.
class Drainage {
 public:
  Drainage(const HeightGrid& ground, double most_m)
      : columns_(static_cast<std::size_t>(ground.columns()) + 2),
        step_m_(glm::abs(ground.step_m())),
        heights_m_(columns_ * (static_cast<std::size_t>(ground.rows()) + 2),
                   std::numeric_limits<float>::quiet_NaN()),
        outlets_(heights_m_.size()) {
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const glm::ivec2 move = neighbours[k];
      moves_m_[k] = glm::dvec2(move) * step_m_;
      offsets_[k] = move.y * static_cast<std::ptrdiff_t>(columns_) + move.x;
    }
    for (int row = 0; row < ground.rows(); ++row) {
      for (int column = 0; column < ground.columns(); ++column)
        heights_m_[index_of(column, row)] = ground.height_m(column, row);
    }
    for (std::size_t i = 0; i < heights_m_.size(); ++i)
      outlets_[i] = !std::isnan(heights_m_[i]) && is_at_border(i);
    fill();
    if (drain(most_m)) fill();
  }

  std::size_t index_of(int column, int row) const {
    return (static_cast<std::size_t>(row) + 1) * columns_ + static_cast<std::size_t>(column) + 1;
  }
  const std::vector<float>& surface_m() const { return surface_m_; }

  // Returns the area that drains through each sample, m^2.
  std::vector<double> areas_m2() const {
    std::vector<double> areas(heights_m_.size(), step_m_.x * step_m_.y);
    for (std::size_t i = order_.size(); i-- > 0;) pass_on(order_[i], areas);
    return areas;
  }

  // Returns the slope of the surface at a sample, by differences of its neighbours.
  double slope(std::size_t at) const {
    glm::dvec2 sum_m(0), span_m(0);  // along the axes
    each_neighbour(at, [&](std::size_t next, glm::dvec2 move_m) {
      for (glm::length_t axis = 0; axis < 2; ++axis) {
        if (move_m[1 - axis] != 0) continue;
        const double rise_m = double{surface_m_[next]} - surface_m_[at];
        sum_m[axis] += move_m[axis] > 0 ? rise_m : -rise_m;
        span_m[axis] += std::abs(move_m[axis]);
      }
    });
    const glm::dvec2 gradient = sum_m / glm::max(span_m, step_m_);
    return glm::length(gradient);
  }

 private:
  static constexpr float infinity = std::numeric_limits<float>::infinity();

  template <typename Act>
  void each_neighbour(std::size_t at, const Act& act) const {
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const std::size_t next = at + static_cast<std::size_t>(offsets_[k]);
      if (!std::isnan(heights_m_[next])) act(next, moves_m_[k]);
    }
  }

  bool is_at_border(std::size_t at) const {  // or next to a hole
    int count = 0;
    each_neighbour(at, [&](std::size_t, glm::dvec2) { ++count; });
    return count < 8;
  }

  // Sample that waits for its neighbours, sorted by its surface, then by its index.
  static std::uint64_t entry_of(float surface_m, std::size_t at) {
    const auto bits = std::bit_cast<std::uint32_t>(surface_m + 0.0F);
    const std::uint32_t sortable = bits >> 31 != 0 ? ~bits : bits | 0x80000000U;
    return std::uint64_t{sortable} << 32 | at;
  }
  using Open = std::priority_queue<std::uint64_t, std::vector<std::uint64_t>, std::greater<>>;

  // Priority-flood: the surface rises from the outlets inwards, lowest first.
  void fill() {
    surface_m_.assign(heights_m_.size(), infinity);
    receivers_.assign(heights_m_.size(), 0);
    order_.clear();
    order_.reserve(heights_m_.size());
    Open open;
    for (std::size_t i = 0; i < heights_m_.size(); ++i) {
      if (outlets_[i]) open_outlet(i, open);
    }
    spread(open);
  }

  void open_outlet(std::size_t at, Open& open) {
    surface_m_[at] = heights_m_[at];
    receivers_[at] = at;
    open.push(entry_of(surface_m_[at], at));
  }

  // Finds the surface of all samples where it is infinite.
  void spread(Open& open) {
    while (!open.empty()) {
      const std::size_t at = open.top() & 0xffffffffU;
      open.pop();
      order_.push_back(at);
      each_neighbour(at, [&](std::size_t next, glm::dvec2) {
        if (surface_m_[next] < infinity) return;
        surface_m_[next] = std::max(heights_m_[next], surface_m_[at]);
        receivers_[next] = at;
        open.push(entry_of(surface_m_[next], next));
      });
    }
  }

  // Makes the lowest samples of depressions that are deeper than `most_m` outlets, until there are
  // none; returns whether there were any. What it leaves is of use to fill() alone.
  bool drain(double most_m) {
    const auto is_wet = [&](std::size_t at) { return surface_m_[at] > heights_m_[at]; };
    std::vector<std::uint32_t> pool_of(heights_m_.size(), 0);
    std::uint32_t pools = 0;
    std::vector<std::size_t> starts = order_, water;
    bool has_drained = false;
    while (!starts.empty()) {
      const std::size_t start = starts.back();
      starts.pop_back();
      if (!is_wet(start) || pool_of[start] != 0) continue;
      const std::uint32_t pool = ++pools;
      const float level_m = surface_m_[start];
      water = {start};
      pool_of[start] = pool;
      std::size_t lowest = start;
      for (std::size_t i = 0; i < water.size(); ++i) {
        if (std::pair(heights_m_[water[i]], water[i]) < std::pair(heights_m_[lowest], lowest))
          lowest = water[i];
        each_neighbour(water[i], [&](std::size_t next, glm::dvec2) {
          if (pool_of[next] == pool || surface_m_[next] != level_m || !is_wet(next)) return;
          pool_of[next] = pool;
          water.push_back(next);
        });
      }
      if (double{level_m} - heights_m_[lowest] <= most_m) continue;
      // The ground around keeps its surface; the rest of the pool is filled anew.
      outlets_[lowest] = has_drained = true;
      Open open;
      for (const std::size_t at : water) surface_m_[at] = infinity;
      open_outlet(lowest, open);
      for (const std::size_t at : water) {
        pool_of[at] = 0;
        each_neighbour(at, [&](std::size_t next, glm::dvec2) {
          if (surface_m_[next] < infinity && next != lowest)
            open.push(entry_of(surface_m_[next], next));
        });
      }
      spread(open);
      starts.insert(starts.end(), water.begin(), water.end());
    }
    return has_drained;
  }

  // Adds a sample's area to those of its lower neighbours, in proportion to powers of the slopes,
  // or in standing water to the neighbour from which it was filled.
  void pass_on(std::size_t at, std::vector<double>& areas) const {
    if (receivers_[at] == at) return;
    double sum = 0;
    std::array<std::pair<std::size_t, double>, 8> shares{};
    std::size_t count = 0;
    each_neighbour(at, [&](std::size_t next, glm::dvec2 move_m) {
      const double fall_m = double{surface_m_[at]} - surface_m_[next];
      if (fall_m <= 0) return;
      const double share = math::pow(fall_m / glm::length(move_m), convergence);
      shares[count++] = {next, share};
      sum += share;
    });
    if (sum == 0) areas[receivers_[at]] += areas[at];
    for (std::size_t i = 0; i < count && sum > 0; ++i)
      areas[shares[i].first] += areas[at] * shares[i].second / sum;
  }

  std::size_t columns_;
  glm::dvec2 step_m_;
  std::array<glm::dvec2, 8> moves_m_{};      // to the neighbours
  std::array<std::ptrdiff_t, 8> offsets_{};  // of their indices
  std::vector<float> heights_m_;
  std::vector<bool> outlets_;
  std::vector<float> surface_m_;        // of the water, or of dry ground
  std::vector<std::size_t> receivers_;  // neighbours towards the outlet; outlets are their own
  std::vector<std::size_t> order_;      // from the outlets upwards
};

}  // namespace

HeightGrid sample_ground(const Ground& ground, double cell_m, std::size_t memory_bytes) {
  constexpr double bytes_per_sample =
      80;  // of heights, surface, areas, receivers, order, pools and queue
  const GridFrame& frame = ground.frame();
  const glm::dvec2 a = frame.to_D({0, 0}), b = frame.to_D(frame.samples - 1);
  const glm::dvec2 low = glm::min(a, b), extent_m = glm::max(a, b) - low;
  const glm::dvec2 count = glm::max(glm::floor(extent_m / cell_m * (1 + 1e-12)) + 1.0, 2.0);
  if (std::min(count.x, count.y) < 10) {
    throw Error("water: cell_m = {:g} leaves {:g} x {:g} samples of the ground; make it smaller",
                cell_m, count.x, count.y);
  }
  const double bytes = count.x * count.y * bytes_per_sample;
  if (bytes > static_cast<double>(memory_bytes)) {
    throw Error(
        "water: a grid of {:g} x {:g} samples takes {:g} MiB, more than the limit of {:g}; make "
        "its cell_m (now {:g}) larger, or allow more memory",
        count.x, count.y, bytes / (1 << 20), static_cast<double>(memory_bytes) / (1 << 20), cell_m);
  }
  const glm::ivec2 size(count);
  const glm::dvec2 origin_m(low.x, low.y + cell_m * (size.y - 1));
  const auto columns = static_cast<std::size_t>(size.x);
  std::vector<float> heights_m(columns * static_cast<std::size_t>(size.y));
  run_pass(run_in_parallel, static_cast<std::size_t>(size.y), [&](std::size_t row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const glm::dvec2 p = origin_m + cell_m * glm::dvec2(column, -static_cast<double>(row));
      heights_m[row * columns + column] = static_cast<float>(
          ground.height_m_at(p).value_or(std::numeric_limits<double>::quiet_NaN()));
    }
  });
  return {size, origin_m, {cell_m, -cell_m}, std::move(heights_m)};
}

StandingWater standing_water(const HeightGrid& ground, double most_m, Wetness wetness) {
  const Drainage drainage(ground, most_m);
  const auto per_sample = [&](const auto& value_at) {
    std::vector<float> values;
    values.reserve(ground.heights_m().size());
    for (int row = 0; row < ground.rows(); ++row) {
      for (int column = 0; column < ground.columns(); ++column) {
        const float height_m = ground.height_m(column, row);
        values.push_back(std::isnan(height_m) ? height_m
                                              : value_at(drainage.index_of(column, row), height_m));
      }
    }
    return values;
  };
  StandingWater water{.frame = ground.frame(), .depth_m = {}, .wetness = {}};
  water.depth_m = per_sample(
      [&](std::size_t at, float height_m) { return drainage.surface_m()[at] - height_m; });
  if (wetness == Wetness::Omit) return water;
  const std::vector<double> areas_m2 = drainage.areas_m2();
  const glm::dvec2 step_m = glm::abs(ground.step_m());
  const double width_m = std::sqrt(step_m.x * step_m.y);
  water.wetness = per_sample([&](std::size_t at, float /*height_m*/) {
    const double slope = std::max(least_slope, drainage.slope(at));
    return static_cast<float>(math::log(areas_m2[at] / width_m / slope));
  });
  return water;
}

}  // namespace groundray
