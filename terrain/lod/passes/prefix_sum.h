#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace groundray::passes {

// Prefix sums of counts, in 64 bits: the counts are divided into parts, whose sums are summed up in
// the same way, until there is one part.

/// Array that is divided into parts; each part is one index of a pass.
template <typename T>
struct Parts {
  T* values;
  std::size_t size;
  std::size_t length;   ///< of a part, at most
  std::uint64_t* sums;  ///< of the parts, or of those before each part

  std::size_t count() const noexcept { return (size + length - 1) / length; }

  /// Writes the sum of a part.
  void add(std::size_t index) const noexcept {
    std::uint64_t sum = 0;
    for (std::size_t i = index * length; i < end(index); ++i) sum += values[i];
    sums[index] = sum;
  }
  /// Replaces the values of a part by the sums of those before them, of all parts. The first part
  /// needs no `sums`.
  void replace(std::size_t index) const noexcept {
    std::uint64_t sum = index == 0 ? 0 : sums[index];
    for (std::size_t i = index * length; i < end(index); ++i) {
      const T value = values[i];
      values[i] = static_cast<T>(sum);
      sum += value;
    }
  }

 private:
  std::size_t end(std::size_t index) const noexcept { return std::min((index + 1) * length, size); }
};

/// Sums up each part of an array of counts.
struct SumCountsPass {
  static constexpr char name[] = "SumCountsPass";

  Parts<std::uint32_t> parts;

  void operator()(std::size_t index) const noexcept { parts.add(index); }
};

/// Replaces counts by the sums of those before them.
struct ReplaceCountsPass {
  static constexpr char name[] = "ReplaceCountsPass";

  Parts<std::uint32_t> parts;

  void operator()(std::size_t index) const noexcept { parts.replace(index); }
};

/// Sums up each part of an array of sums.
struct SumSumsPass {
  static constexpr char name[] = "SumSumsPass";

  Parts<std::uint64_t> parts;

  void operator()(std::size_t index) const noexcept { parts.add(index); }
};

/// Replaces sums by the sums of those before them.
struct ReplaceSumsPass {
  static constexpr char name[] = "ReplaceSumsPass";

  Parts<std::uint64_t> parts;

  void operator()(std::size_t index) const noexcept { parts.replace(index); }
};

}  // namespace groundray::passes
