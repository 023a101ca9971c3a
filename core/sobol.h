#pragma once

#include <bit>
#include <cstdint>
#include <glm/vec2.hpp>

namespace groundray {

/// Points that fill the unit square evenly, one pair of dimensions after the other: Sobol's first
/// two dimensions, with hash-based Owen scrambling and in an order that is shuffled anew for each
/// pair. The first 2^k points form a net for every k: all elementary intervals contain equal
/// numbers of them. So do the next 2^k points, and every further 2^k.
/// @see Burley, Practical hash-based Owen scrambling, JCGT 9(4) (2020); Laine and Karras,
///      Stratified sampling for stochastic transparency, EGSR (2011); constants of the hash:
///      Vegdahl, Building a better LK hash (2021).
class SobolPairs {
 public:
  /// @param seed  identifies pixel and frame: sequences of different seeds are independent.
  /// @param index  of the sample in its sequence.
  constexpr SobolPairs(std::uint32_t seed, std::uint32_t index) : seed_(seed), index_(index) {}

  /// Returns the next pair of dimensions, in [0, 1)^2.
  glm::dvec2 next() noexcept {
    const std::uint32_t pair = mixed(seed_ + 0x9e3779b9u * ++pairs_);
    const std::uint32_t i = scrambled(index_, pair);
    const std::uint32_t x = reversed_scramble(i, mixed(pair ^ 0x68bc21ebu));
    const std::uint32_t y = reversed_scramble(second(i), mixed(pair ^ 0x02e5be93u));
    return {x * 0x1p-32, y * 0x1p-32};
  }

  /// Returns a hash that mixes all bits.
  /// @see Ellis and Wellons, lowbias32 (2018).
  static constexpr std::uint32_t mixed(std::uint32_t x) noexcept {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
  }

 private:
  static constexpr std::uint32_t reversed(std::uint32_t x) noexcept {
    x = (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
    x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
    x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
    x = (x >> 8 & 0x00ff00ffu) | (x & 0x00ff00ffu) << 8;
    return x >> 16 | x << 16;
  }
  // Flips each bit depending on a hash of the bits below it.
  static constexpr std::uint32_t flipped(std::uint32_t x, std::uint32_t seed) noexcept {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1;
    x ^= x * 0x05526c56u;
    return x ^ x * 0x53a22864u;
  }
  static constexpr std::uint32_t scrambled(std::uint32_t x, std::uint32_t seed) noexcept {
    return reversed(flipped(reversed(x), seed));
  }
  // The first Sobol dimension is the index with its bits reversed; this reversal and the one before
  // the flips cancel each other.
  static constexpr std::uint32_t reversed_scramble(std::uint32_t x, std::uint32_t seed) noexcept {
    return reversed(flipped(x, seed));
  }
  // Returns the second Sobol dimension with its bits reversed. Bit i is the sum modulo 2 of those
  // bits of x whose number has all the bits of i: Pascal's triangle modulo 2.
  static constexpr std::uint32_t second(std::uint32_t x) noexcept {
    x ^= x >> 16;
    x ^= x >> 8 & 0x00ff00ffu;
    x ^= x >> 4 & 0x0f0f0f0fu;
    x ^= x >> 2 & 0x33333333u;
    return x ^ (x >> 1 & 0x55555555u);
  }

  std::uint32_t seed_, index_;
  std::uint32_t pairs_ = 0;
};

}  // namespace groundray
