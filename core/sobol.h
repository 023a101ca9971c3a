#pragma once

#include <bit>
#include <cstdint>
#include <glm/vec2.hpp>

namespace groundray {

/// Points that fill the unit square evenly, pair of dimensions by pair: Sobol's first two
/// dimensions, scrambled as Owen does by hashing, and in an order that is shuffled anew for each
/// pair. Every power of two of points from the start is a net: each elementary interval has its
/// share of them.
/// @see Burley, Practical hash-based Owen scrambling, JCGT 9(4) (2020); Laine and Karras,
///      Stratified sampling for stochastic transparency, EGSR (2011); constants of the hash:
///      Vegdahl, Building a better LK hash (2021).
class SobolPairs {
 public:
  /// @param seed  of a pixel and frame: sequences of different seeds are independent.
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

  /// A hash that mixes all bits. @see Ellis and Wellons, lowbias32 (2018).
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
  // Flips each bit by a hash of the bits below it.
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
  // The first dimension of Sobol is the index with its bits reversed, so that the reversal before
  // the flips and that of the dimension undo each other.
  static constexpr std::uint32_t reversed_scramble(std::uint32_t x, std::uint32_t seed) noexcept {
    return reversed(flipped(x, seed));
  }
  // The second dimension with its bits reversed: each the sum of those
  // bits whose number has all the bits of its own, Pascal's triangle modulo 2.
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
