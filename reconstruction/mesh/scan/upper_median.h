#pragma once

// Private to the library: median of many numbers.
#include <algorithm>
#include <cstddef>
#include <vector>

namespace groundray {

/// Returns the median of `values`, or the upper of two, and changes their order. There must be at
/// least one value.
inline double upper_median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace groundray
