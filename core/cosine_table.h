#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace groundray {

/// A function of the cosine of an angle to the normal, from 0 to 1, as plain data: exact at nodes
/// whose square roots are evenly spaced, so that they crowd at grazing angles, and linear in the
/// root between them.
/// @tparam T  float, or a vector of floats.
template <typename T>
class CosineTable {
 public:
  static constexpr std::size_t size = 64;

  /// A table of zeros.
  CosineTable() = default;

  /// @param function  returns the value at a cosine.
  template <typename Function>
  explicit CosineTable(Function function) {
    for (std::size_t i = 0; i < size; ++i) {
      const double root = static_cast<double>(i) / (size - 1);
      values_[i] = function(root * root);
    }
  }

  /// Returns the value at a cosine; one beyond [0, 1] is taken as the nearer of the two.
  T operator()(double cosine) const noexcept {
    const double place = std::sqrt(std::clamp(cosine, 0.0, 1.0)) * (size - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(place), size - 2);
    const auto share = static_cast<float>(place - static_cast<double>(i));
    return values_[i] * (1 - share) + values_[i + 1] * share;
  }

  /// Returns the mean over the hemisphere that each cosine weighs, 2 times the integral of value
  /// times cosine: exact of what operator() returns.
  T mean() const noexcept {
    T sum = values_[0] * 0.0f;
    double before = 0;  // fourth power of a root, then its fifth
    double before5 = 0;
    for (std::size_t i = 0; i + 1 < size; ++i) {
      const double low = static_cast<double>(i) / (size - 1);
      const double root = static_cast<double>(i + 1) / (size - 1);
      const double after = root * root * root * root;
      const double after5 = after * root;
      // 4 root^3 droot times a line from one node to the next
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
