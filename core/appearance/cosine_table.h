#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>

#include "core/pack.h"

namespace groundray {

/// Tabulated function of the cosine of an angle to the normal, 0 to 1, as plain data. It is exact
/// at its nodes and linear in the square root of the cosine between them. The nodes are evenly
/// spaced in that root, and thus dense at grazing angles.
/// @tparam T  float, or a vector of floats.
template <typename T>
class CosineTable {
 public:
  static constexpr std::size_t size = 64;

  /// Constructs a table of zeros.
  CosineTable() = default;

  /// @param function  returns the value at a cosine.
  template <typename Function>
  explicit CosineTable(Function function) {
    for (std::size_t i = 0; i < size; ++i) {
      const double root = static_cast<double>(i) / (size - 1);
      values_[i] = function(root * root);
    }
  }

  /// Returns the value at a cosine, which is clamped to [0, 1]; at 0 for NaN.
  T operator()(double cosine) const noexcept {
    const double place = std::sqrt(cosine > 0 ? std::min(cosine, 1.0) : 0.0) * (size - 1);
    const int i = std::min(static_cast<int>(place), static_cast<int>(size) - 2);
    const auto share = static_cast<float>(place - i);
    const T* const node = values_.data() + i;
    return node[0] * (1 - share) + node[1] * share;
  }

  /// Returns the values at the cosines of a pack's lanes.
  auto operator()(const Pack& cosine) const noexcept {
    if constexpr (std::is_same_v<T, float>) {
      return pack_of([&](std::size_t i) { return (*this)(double{cosine[i]}); });
    } else {
      return vectors_of([&](std::size_t i) { return (*this)(double{cosine[i]}); });
    }
  }

  /// Returns the cosine-weighted mean over the hemisphere: twice the integral of value times
  /// cosine, exact for the values that operator() returns.
  T mean() const noexcept {
    T sum = values_[0] * 0.0f;
    double before = 0;  // fourth power of the lower node's root, and its fifth
    double before5 = 0;
    for (std::size_t i = 0; i + 1 < size; ++i) {
      const double low = static_cast<double>(i) / (size - 1);
      const double root = static_cast<double>(i + 1) / (size - 1);
      const double after = root * root * root * root;
      const double after5 = after * root;
      // integral of 4 root^3 times the linear interpolant of two nodes
      const double whole = after - before;
      const double slope = 0.8 * (after5 - before5) - whole * low;
      const auto upper = static_cast<float>(slope * (size - 1));
      sum = sum + values_[i] * (static_cast<float>(whole) - upper) + values_[i + 1] * upper;
      before = after;
      before5 = after5;
    }
    return sum;
  }

 private:
  std::array<T, size> values_{};
};

}  // namespace groundray
