#pragma once

// Private to the library: vectors of eight numbers. Sums have a fixed order, the same on any
// machine; compilers do not vectorise these loops by themselves.
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

}  // namespace groundray
