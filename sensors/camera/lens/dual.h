#pragma once

#include <cmath>

#include "core/math.h"

namespace groundray {

/// Dual number: a value and its derivatives by two variables. Arithmetic propagates the derivatives
/// exactly.
struct Dual {
  double value = 0;
  double dx = 0, dy = 0;

  constexpr Dual() = default;
  constexpr Dual(double constant) : value(constant) {}  // NOLINT(google-explicit-constructor)
  constexpr Dual(double v, double by_x, double by_y) : value(v), dx(by_x), dy(by_y) {}

  friend constexpr Dual operator+(const Dual& a, const Dual& b) {
    return {a.value + b.value, a.dx + b.dx, a.dy + b.dy};
  }
  friend constexpr Dual operator-(const Dual& a, const Dual& b) {
    return {a.value - b.value, a.dx - b.dx, a.dy - b.dy};
  }
  friend constexpr Dual operator-(const Dual& a) { return {-a.value, -a.dx, -a.dy}; }
  friend constexpr Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, a.dx * b.value + a.value * b.dx, a.dy * b.value + a.value * b.dy};
  }
  friend constexpr Dual operator/(const Dual& a, const Dual& b) {
    const double inverse = 1 / b.value, q = a.value * inverse;
    return {q, (a.dx - q * b.dx) * inverse, (a.dy - q * b.dy) * inverse};
  }

  // Overloads for plain numbers, whose derivatives are 0: a compiler may not omit products with 0.
  friend constexpr Dual operator+(const Dual& a, double b) { return {a.value + b, a.dx, a.dy}; }
  friend constexpr Dual operator+(double a, const Dual& b) { return b + a; }
  friend constexpr Dual operator-(const Dual& a, double b) { return {a.value - b, a.dx, a.dy}; }
  friend constexpr Dual operator-(double a, const Dual& b) { return {a - b.value, -b.dx, -b.dy}; }
  friend constexpr Dual operator*(const Dual& a, double b) {
    return {a.value * b, a.dx * b, a.dy * b};
  }
  friend constexpr Dual operator*(double a, const Dual& b) { return b * a; }
  friend constexpr Dual operator/(const Dual& a, double b) { return a * (1 / b); }
  friend constexpr Dual operator/(double a, const Dual& b) {
    const double inverse = 1 / b.value, slope = -a * inverse * inverse;
    return {a * inverse, slope * b.dx, slope * b.dy};
  }
  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }

  /// Returns a function of this number, given the function's value and derivative here.
  constexpr Dual chain(double f, double slope) const { return {f, slope * dx, slope * dy}; }
};

/// @name Functions of dual numbers
/// @{

/// Functions of plain numbers, extended to derivatives.
inline Dual sqrt(const Dual& a) {
  const double root = std::sqrt(a.value);
  return a.chain(root, 0.5 / root);
}
inline Dual atan2(const Dual& y, const Dual& x) {
  const double square = x.value * x.value + y.value * y.value;
  return {math::atan2(y.value, x.value), (x.value * y.dx - y.value * x.dx) / square,
          (x.value * y.dy - y.value * x.dy) / square};
}
inline Dual sin(const Dual& a) { return a.chain(math::sin(a.value), math::cos(a.value)); }
inline Dual cos(const Dual& a) { return a.chain(math::cos(a.value), -math::sin(a.value)); }
inline Dual asin(const Dual& a) {
  return a.chain(math::asin(a.value), 1 / std::sqrt(1 - a.value * a.value));
}
/// @}

/// Returns the number itself.
inline double value_of(double a) { return a; }
/// Returns the value of a dual number.
inline double value_of(const Dual& a) { return a.value; }

}  // namespace groundray
