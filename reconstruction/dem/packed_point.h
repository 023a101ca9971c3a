#pragma once

// Private to the library: a point as the fusion keeps it, in memory and on disk.
#include <algorithm>
#include <bit>
#include <cstdint>

#include "reconstruction/dem/measured_points.h"

namespace groundray {

/// A point of a tile in 24 bytes. Heights are in steps of 2^-16 m (15 um), places in steps of 2^-16
/// cells, standard deviations of metres and leans in 16 bits, to 1 part in 4096. New ones are not
/// initialised: buffers of them are filled anyway.
struct PackedPoint {
  std::int32_t height;
  std::uint32_t group;   ///< twice its number, and 1 more for stereo
  std::uint16_t cell;    ///< of the tile with its rim: 256 row + column
  std::uint16_t x;       ///< place in the cell, along columns
  std::uint16_t y;       ///< and along rows
  std::uint16_t sd;      ///< of the height: what differs from point to point
  std::uint16_t bias;    ///< of the height: what the group's points have in common
  std::uint16_t across;  ///< of the rest of the place in plan, each way
  std::uint16_t lean_x;  ///< of the place in plan with the height
  std::uint16_t lean_y;

  static constexpr double height_step_m = 1.0 / 65536;
  static constexpr double highest_m = 32767;          ///< and lowest: -32767
  static constexpr std::uint32_t groups = 1U << 31U;  ///< their numbers are below

  PointOrigin origin() const noexcept {
    return (group & 1U) == 0 ? PointOrigin::Lidar : PointOrigin::Stereo;
  }
  double height_m() const noexcept { return height * height_step_m; }
  /// Returns the place in the cell from its sample, in cells: -1/2 to 1/2.
  static float from_sample(std::uint16_t place) noexcept {
    return (static_cast<float>(place) - 32767.5F) * (1.0F / 65536);
  }

  friend auto operator<=>(const PackedPoint&, const PackedPoint&) = default;
};
static_assert(sizeof(PackedPoint) == 24);

/// Returns a number >= 0 in 16 bits: 5 of the exponent and 11 of the rest, rounded. What is below
/// 2^-20 becomes 0, and what is above 4094 becomes 4094.
inline std::uint16_t packed_sd(float value_m) noexcept {
  constexpr std::uint32_t below = (127U - 20U) << 11U;  // 2^-20, less its exponent's place
  const std::uint32_t rounded = (std::bit_cast<std::uint32_t>(value_m) + (1U << 11U)) >> 12U;
  if (rounded < below) return 0;
  return static_cast<std::uint16_t>(std::min(rounded - below + 1, 0xFFFFU));
}

/// Returns what packed_sd was given, but for its rounding.
inline float unpacked_sd(std::uint16_t packed) noexcept {
  constexpr std::uint32_t below = (127U - 20U) << 11U;
  if (packed == 0) return 0;
  return std::bit_cast<float>((packed - 1U + below) << 12U);
}

/// Returns a number of -63 to 63 in 16 bits: its sign, 4 of the exponent and 11 of the rest,
/// rounded. What is nearer to 0 than 2^-10 becomes 0.
inline std::uint16_t packed_lean(float value) noexcept {
  constexpr std::uint32_t below = (127U - 10U) << 11U, sign = 0x8000U;
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t rounded = ((bits & 0x7FFFFFFFU) + (1U << 11U)) >> 12U;
  if (rounded < below) return 0;
  return static_cast<std::uint16_t>((bits >> 16U & sign) + std::min(rounded - below + 1, sign - 1));
}

/// Returns what packed_lean was given, but for its rounding.
inline float unpacked_lean(std::uint16_t packed) noexcept {
  constexpr std::uint32_t below = (127U - 10U) << 11U, sign = 0x8000U;
  const std::uint32_t size = packed & (sign - 1);
  if (size == 0) return 0;
  return std::bit_cast<float>((size - 1 + below) << 12U | (packed & sign) << 16U);
}

}  // namespace groundray
