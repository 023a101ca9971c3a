#pragma once

// Private to the library: the middle one of many numbers.
#include <algorithm>
#include <cstddef>
#include <vector>

namespace groundray {

/// Returns the middle one of `values`, or the upper of both, and changes their order. There is one
/// at least.
inline double upper_median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace groundray
