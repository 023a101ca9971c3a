#pragma once

// Private to the library: a point as the fusion stores it, in memory and on disk.
#include <algorithm>
#include <bit>
#include <cstdint>

#include "reconstruction/dem/measured_points.h"

namespace groundray {

/// Point of a tile in 24 bytes. Heights are in steps of 2^-16 m (15 um), positions in steps of
/// 2^-16 cells; standard deviations in metres and leans take 16 bits each, to 1 part in 4096.
/// Members are not initialised, because buffers of points are filled anyway.
struct PackedPoint {
  std::int32_t height;
  std::uint32_t group;   ///< twice the group's number, plus 1 for stereo
  std::uint16_t cell;    ///< cell of the tile with its margin: 256 row + column
  std::uint16_t x;       ///< position in the cell, along columns
  std::uint16_t y;       ///< position in the cell, along rows
  std::uint16_t sd;      ///< sd of the height, independent from point to point
  std::uint16_t bias;    ///< sd of the height, common to the group's points
  std::uint16_t across;  ///< sd of the remaining position in plan, each way
  std::uint16_t lean_x;  ///< lean of the position in plan with the height
  std::uint16_t lean_y;

  static constexpr double height_step_m = 1.0 / 65536;
  static constexpr double highest_m = 32767;          ///< largest absolute height
  static constexpr std::uint32_t groups = 1U << 31U;  ///< group numbers are below this

  PointOrigin origin() const noexcept {
    return (group & 1U) == 0 ? PointOrigin::Lidar : PointOrigin::Stereo;
  }
  double height_m() const noexcept { return height * height_step_m; }
  /// Returns the position in the cell from its sample, in cells: -1/2 to 1/2.
  static float from_sample(std::uint16_t place) noexcept {
    return (static_cast<float>(place) - 32767.5F) * (1.0F / 65536);
  }

  friend auto operator<=>(const PackedPoint&, const PackedPoint&) = default;
};
static_assert(sizeof(PackedPoint) == 24);

/// Returns a number >= 0 in 16 bits: 5 of the exponent and 11 of the mantissa, rounded. Values
/// below 2^-20 become 0, values above 4094 become 4094.
inline std::uint16_t packed_sd(float value_m) noexcept {
  constexpr std::uint32_t below = (127U - 20U) << 11U;  // 2^-20, shifted like `rounded`
  const std::uint32_t rounded = (std::bit_cast<std::uint32_t>(value_m) + (1U << 11U)) >> 12U;
  if (rounded < below) return 0;
  return static_cast<std::uint16_t>(std::min(rounded - below + 1, 0xFFFFU));
}

/// Returns the value given to packed_sd, except for rounding.
inline float unpacked_sd(std::uint16_t packed) noexcept {
  constexpr std::uint32_t below = (127U - 20U) << 11U;
  if (packed == 0) return 0;
  return std::bit_cast<float>((packed - 1U + below) << 12U);
}

/// Returns a number of -63 to 63 in 16 bits: its sign, 4 of the exponent and 11 of the mantissa,
/// rounded. Values nearer to 0 than 2^-10 become 0.
inline std::uint16_t packed_lean(float value) noexcept {
  constexpr std::uint32_t below = (127U - 10U) << 11U, sign = 0x8000U;
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t rounded = ((bits & 0x7FFFFFFFU) + (1U << 11U)) >> 12U;
  if (rounded < below) return 0;
  return static_cast<std::uint16_t>((bits >> 16U & sign) + std::min(rounded - below + 1, sign - 1));
}

/// Returns the value given to packed_lean, except for rounding.
inline float unpacked_lean(std::uint16_t packed) noexcept {
  constexpr std::uint32_t below = (127U - 10U) << 11U, sign = 0x8000U;
  const std::uint32_t size = packed & (sign - 1);
  if (size == 0) return 0;
  return std::bit_cast<float>((size - 1 + below) << 12U | (packed & sign) << 16U);
}

}  // namespace groundray
