#include "core/quantile.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace groundray {

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  constexpr double rounding = 1e-12;  // so that 0.95 of 20 is 19 despite rounding
  const double count = std::ceil(share * static_cast<double>(values.size()) * (1 - rounding));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::max(count, 1.0)) - 1;
  std::ranges::nth_element(values, at);
  return *at;
}

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, half);
  const double upper = *half;
  if (values.size() % 2 == 1) return upper;
  return (upper + *std::max_element(values.begin(), half)) / 2;
}

double nmad(std::vector<double> values) {
  constexpr double of_normal = 1.4826;
  const double middle = median(values);
  for (double& value : values) value = std::abs(value - middle);
  return of_normal * median(std::move(values));
}

}  // namespace groundray
