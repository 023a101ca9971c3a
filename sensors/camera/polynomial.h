#pragma once

#include <vector>

namespace groundray {

/// A polynomial by its coefficients: of the constant, the first power, the second...
using Polynomial = std::vector<double>;

Polynomial operator+(const Polynomial& a, const Polynomial& b);
Polynomial operator*(const Polynomial& a, const Polynomial& b);
Polynomial derivative(const Polynomial& a);
double value_of(const Polynomial& a, double x);

/// Returns the places above 0 where it changes its sign, rising, each to rounding.
std::vector<double> positive_roots(const Polynomial& a);

}  // namespace groundray
