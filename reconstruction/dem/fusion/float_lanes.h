#pragma once

// Private to the library: vectors of eight numbers. Sums have a fixed order, the same on any
// machine; compilers do not vectorise these loops by themselves.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

namespace groundray {

constexpr std::size_t lanes = 8;

using FloatLanes [[gnu::vector_size(sizeof(float) * lanes)]] = float;
using IntLanes [[gnu::vector_size(sizeof(std::int32_t) * lanes)]] = std::int32_t;

/// Returns `count` rounded up to whole vectors.
constexpr std::size_t whole_lanes(std::size_t count) noexcept {
  return (count + lanes - 1) / lanes * lanes;
}

inline FloatLanes load(const float* from) noexcept {
  FloatLanes all;
  std::memcpy(&all, from, sizeof(all));
  return all;
}
inline IntLanes load(const std::int32_t* from) noexcept {
  IntLanes all;
  std::memcpy(&all, from, sizeof(all));
  return all;
}
inline void store(const FloatLanes& all, float* to) noexcept { std::memcpy(to, &all, sizeof(all)); }
inline void store(const IntLanes& all, std::int32_t* to) noexcept {
  std::memcpy(to, &all, sizeof(all));
}

inline FloatLanes all_of(float value) noexcept { return FloatLanes{} + value; }
inline FloatLanes larger(const FloatLanes& a, const FloatLanes& b) noexcept {
  return a > b ? a : b;
}
inline FloatLanes smaller(const FloatLanes& a, const FloatLanes& b) noexcept {
  return a < b ? a : b;
}
inline FloatLanes size_of(const FloatLanes& a) noexcept { return larger(a, -a); }

/// Returns the lower limit of 1 - slope * lean (see MeasuredPoints): a half, or a tenth of the lean
/// if that is more, as at an incidence of 84 degrees, whose cosine is a tenth. At 0, along a line
/// of sight, errors would have no effect at all, and slopes fitted to few points would tend there.
/// Both numbers are empirical: with them, errors with a lean are as large as stated (see the tests
/// of CellFit), and points at grazing incidence have less weight than possible.
inline FloatLanes least_tilt(const FloatLanes& lean_x, const FloatLanes& lean_y) noexcept {
  return larger(all_of(0.5F), 0.1F * larger(size_of(lean_x), size_of(lean_y)));
}

inline float total(const FloatLanes& a) noexcept {
  return ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]));
}

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
