#pragma once

#include <vector>

namespace groundray {

/// Returns the smallest of `values` that at least the fraction `share` of them, above 0 and up to
/// 1, does not exceed; NaN if there are none.
double quantile(std::vector<double> values, double share);

/// Returns the median, which is the mean of the two middle values if their number is even; NaN if
/// there are none.
double median(std::vector<double> values);

/// Returns 1.4826 times the median absolute deviation from the median, which is the standard
/// deviation of normally distributed values; NaN if there are none.
double nmad(std::vector<double> values);

}  // namespace groundray
