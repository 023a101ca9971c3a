#pragma once

#include <cstdint>

namespace groundray {

/// Step between the states of SplitMix64: 2^64 divided by the golden ratio.
inline constexpr std::uint64_t golden_step = 0x9e3779b97f4a7c15;

/// Mixes the bits of a number: the finalizer of SplitMix64.
/// @see Steele, Lea and Flood, Fast splittable pseudorandom number generators (2014).
constexpr std::uint64_t mixed_bits(std::uint64_t bits) noexcept {
  bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9;
  bits = (bits ^ bits >> 27) * 0x94d049bb133111eb;
  return bits ^ bits >> 31;
}

}  // namespace groundray
