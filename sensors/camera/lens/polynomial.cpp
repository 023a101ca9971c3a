#include "sensors/camera/lens/polynomial.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace groundray {

Polynomial operator+(const Polynomial& a, const Polynomial& b) {
  Polynomial sum(std::max(a.size(), b.size()));
  for (std::size_t i = 0; i < a.size(); ++i) sum[i] += a[i];
  for (std::size_t i = 0; i < b.size(); ++i) sum[i] += b[i];
  return sum;
}

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  Polynomial product(a.size() + b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  }
  return product;
}

Polynomial derivative(const Polynomial& a) {
  Polynomial slope;
  for (std::size_t i = 1; i < a.size(); ++i) slope.push_back(static_cast<double>(i) * a[i]);
  return slope;
}

double value_of(const Polynomial& a, double x) {
  double sum = 0;
  for (std::size_t i = a.size(); i-- > 0;) sum = sum * x + a[i];
  return sum;
}

std::vector<double> positive_roots(const Polynomial& a) {
  Polynomial trimmed = a;
  while (!trimmed.empty() && trimmed.back() == 0) trimmed.pop_back();
  if (trimmed.size() < 2) return {};
  // The polynomial is monotonic between the roots of its derivative, and has no roots beyond
  // Cauchy's bound.
  double largest = 0;
  for (const double coefficient : trimmed)
    largest = std::max(largest, std::abs(coefficient / trimmed.back()));
  std::vector<double> ends = positive_roots(derivative(trimmed));
  ends.insert(ends.begin(), 0.0);
  ends.push_back(1 + largest);
  std::vector<double> roots;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    double low = ends[i], high = ends[i + 1];
    const bool rises = value_of(trimmed, low) < 0;
    if (rises == (value_of(trimmed, high) < 0)) continue;
    for (double middle = (low + high) / 2; low < middle && middle < high; middle = (low + high) / 2)
      ((value_of(trimmed, middle) < 0) == rises ? low : high) = middle;
    roots.push_back(high);
  }
  return roots;
}

}  // namespace groundray
