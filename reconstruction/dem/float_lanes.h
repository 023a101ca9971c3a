#pragma once

// Private to the library: eight numbers at once. Sums have an order of their own, the same on any
// machine; compilers would not find these loops.
#include <cstddef>
#include <cstdint>
#include <cstring>

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
inline FloatLanes size_of(const FloatLanes& a) noexcept { return larger(a, -a); }

inline float total(const FloatLanes& a) noexcept {
  return ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]));
}

}  // namespace groundray
