#pragma once

#include <vector>

namespace groundray {

/// Polynomial, as its coefficients: of the constant, the first power, the second...
using Polynomial = std::vector<double>;

Polynomial operator+(const Polynomial& a, const Polynomial& b);
Polynomial operator*(const Polynomial& a, const Polynomial& b);
Polynomial derivative(const Polynomial& a);
double value_of(const Polynomial& a, double x);

/// Returns the positive arguments at which the polynomial changes its sign, ascending, to rounding.
std::vector<double> positive_roots(const Polynomial& a);

}  // namespace groundray
