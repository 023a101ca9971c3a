#pragma once

// Private to the library: order statistics of a few numbers by counting, without mispredicted
// branches.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "reconstruction/dem/fusion/float_lanes.h"

namespace groundray {

/// Maximum number of values to count.
constexpr std::size_t few_numbers = 128;

/// Counts for each lane the `values` below it.
template <typename T, typename Lanes>
IntLanes count_below(const T* values, std::size_t count, const Lanes& own) noexcept {
  IntLanes sum{};
  for (std::size_t j = 0; j < count; ++j) sum -= values[j] < own;  // true is -1
  return sum;
}

/// Counts for each of `values` the values below it.
/// @param values  `count` numbers, with room for whole_lanes(count).
/// @param below  as much room; entries beyond `count` are unspecified.
inline void count_below_each(const std::int32_t* values, std::size_t count,
                             std::int32_t* below) noexcept {
  for (std::size_t block = 0; block < count; block += lanes)
    store(count_below(values, count, load(values + block)), below + block);
}

/// Returns the k-th smallest of `values`, the smallest for k = 0.
/// @param values  `count` numbers without NaN, with room for whole_lanes(count).
/// @param count  above k, at most few_numbers.
inline float kth_of_few(float* values, std::size_t count, std::size_t k) noexcept {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  std::fill(values + count, values + whole_lanes(count), infinity);
  // The k-th smallest is the largest value with at most k values below it.
  const auto most_below = static_cast<std::int32_t>(k);
  const FloatLanes none = all_of(-infinity);
  FloatLanes best = none;
  for (std::size_t block = 0; block < count; block += lanes) {
    const FloatLanes own = load(values + block);
    best = larger(best, count_below(values, count, own) <= most_below ? own : none);
  }
  float found = -infinity;
  for (std::size_t i = 0; i < lanes; ++i) found = std::max(found, best[i]);
  return found;
}

}  // namespace groundray
