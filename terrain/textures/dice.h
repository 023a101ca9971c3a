#pragma once

// Private to the library: random numbers of generated images.
#include <cstdint>
#include <numbers>

#include "core/math.h"
#include "core/mixed_bits.h"

namespace groundray::ground {

/// Sequence of random numbers: SplitMix64.
class Dice {
 public:
  explicit constexpr Dice(std::uint64_t seed) noexcept : state_(mixed_bits(seed + golden_step)) {}

  /// Returns a number in [0, 1).
  constexpr double unit() noexcept {
    return static_cast<double>(mixed_bits(state_ += golden_step) >> 11) * 0x1p-53;
  }
  constexpr double between(double low, double high) noexcept { return low + (high - low) * unit(); }
  constexpr bool chance(double probability) noexcept { return unit() < probability; }
  constexpr double angle_rad() noexcept { return 2 * std::numbers::pi * unit(); }
  /// Returns a number whose logarithm is uniform: small sizes are more frequent than large ones.
  double logarithmic(double low, double high) noexcept {
    return low * math::pow(high / low, unit());
  }
  /// Returns the seed of an independent sequence.
  constexpr std::uint64_t seed() noexcept { return mixed_bits(state_ += golden_step); }

 private:
  std::uint64_t state_;
};

}  // namespace groundray::ground
