#pragma once

#include <cstdint>
#include <type_traits>

#include "core/pack.h"

namespace groundray {

/// Points that fill the unit square evenly, one pair of dimensions after the other: Sobol's first
/// two dimensions, with hash-based Owen scrambling and in an order that is shuffled anew for each
/// pair. The first 2^k points form a net for every k: all elementary intervals contain equal
/// numbers of them. So do the next 2^k points, and every further 2^k.
/// @see Burley, Practical hash-based Owen scrambling, JCGT 9(4) (2020); Laine and Karras,
///      Stratified sampling for stochastic transparency, EGSR (2011); constants of the hash:
///      Vegdahl, Building a better LK hash (2021).
/// @tparam Word  std::uint32_t for one point, or PackOfWords for a pack.
template <typename Word>
class SobolPairsOf {
 public:
  using Real = std::conditional_t<std::is_same_v<Word, std::uint32_t>, double, Pack>;

  /// @param seed  identifies pixel and frame: sequences of different seeds are independent.
  /// @param index  of the sample in its sequence.
  /// @param pairs  number of pairs of dimensions that are used up.
  constexpr SobolPairsOf(const Word& seed, const Word& index, const Word& pairs = Word(0u))
      : seed_(seed), index_(index), pairs_(pairs) {}

  /// Returns the next pair of dimensions, in [0, 1)^2.
  Vec2<Real> next() noexcept {
    skip();
    const Word pair = mixed(Word(seed_ + 0x9e3779b9u * pairs_));
    const Word i = scrambled(index_, pair);
    const Word x = reversed_scramble(i, mixed(Word(pair ^ 0x68bc21ebu)));
    const Word y = reversed_scramble(second(i), mixed(Word(pair ^ 0x02e5be93u)));
    return {fraction(x), fraction(y)};
  }
  /// Omits the next pair of dimensions.
  void skip() noexcept { pairs_ = pairs_ + Word(1u); }

  const Word& seed() const noexcept { return seed_; }
  const Word& index() const noexcept { return index_; }
  const Word& pairs() const noexcept { return pairs_; }

  /// Returns a hash that mixes all bits.
  /// @see Ellis and Wellons, lowbias32 (2018).
  static constexpr Word mixed(Word x) noexcept {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
  }

 private:
  static constexpr Word reversed(Word x) noexcept {
    x = (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
    x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
    x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
    x = (x >> 8 & 0x00ff00ffu) | (x & 0x00ff00ffu) << 8;
    return x >> 16 | x << 16;
  }
  // Flips each bit depending on a hash of the bits below it.
  static constexpr Word flipped(Word x, const Word& seed) noexcept {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    return x ^ x * 0x53a22864u;
  }
  static constexpr Word scrambled(Word x, const Word& seed) noexcept {
    return reversed(flipped(reversed(x), seed));
  }
  // The first Sobol dimension is the index with its bits reversed; this reversal and the one before
  // the flips cancel each other.
  static constexpr Word reversed_scramble(Word x, const Word& seed) noexcept {
    return reversed(flipped(x, seed));
  }
  // Returns the second Sobol dimension with its bits reversed. Bit i is the sum modulo 2 of those
  // bits of x whose number has all the bits of i: Pascal's triangle modulo 2.
  static constexpr Word second(Word x) noexcept {
    x ^= x >> 16;
    x ^= x >> 8 & 0x00ff00ffu;
    x ^= x >> 4 & 0x0f0f0f0fu;
    x ^= x >> 2 & 0x33333333u;
    return x ^ (x >> 1 & 0x55555555u);
  }

  // Returns x / 2^32. Of packs, signed words alone are converted by one instruction.
  static Real fraction(const Word& x) noexcept {
    if constexpr (std::is_same_v<Word, std::uint32_t>) {
      return x * 0x1p-32;
    } else {
      const auto shifted =
          std::experimental::static_simd_cast<std::experimental::rebind_simd_t<std::int32_t, Pack>>(
              Word(x ^ 0x80000000u));
      return (std::experimental::static_simd_cast<Pack>(shifted) + 0x1p31) * 0x1p-32;
    }
  }

  Word seed_, index_, pairs_;
};

/// One sequence.
using SobolPairs = SobolPairsOf<std::uint32_t>;

}  // namespace groundray
