#pragma once

#include <vector>

namespace groundray {

/// Returns the smallest of `values` that a share of them, above 0 and up to 1, does not exceed; NaN
/// of none.
double quantile(std::vector<double> values, double share);

/// Returns the middle one of `values`, or the mean of both; NaN of none.
double median(std::vector<double> values);

/// Returns 1.4826 times the median of distances to the median: of normal values the standard
/// deviation; NaN of none.
double nmad(std::vector<double> values);

}  // namespace groundray
