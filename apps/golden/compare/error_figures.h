#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "apps/golden/report.h"

namespace groundray::golden {

/// Statistics of a set of errors e. Quantiles are interpolated linearly between ranks, as in NumPy.
struct ErrorFigures {
  std::size_t count = 0;
  double mean = 0;
  double rms = 0;
  double mean_size = 0;    ///< mean of |e|
  double median = 0;       ///< median of e, with signs
  double median_size = 0;  ///< median of |e|
  double p95_size = 0;
  double p99_size = 0;
  double largest = 0;     ///< maximum of |e|
  std::size_t worst = 0;  ///< index of the first error of that magnitude
  double nmad = 0;  ///< 1.4826 median |e - median|: the standard deviation if errors are normal
};

/// Returns the statistics of errors.
/// @param errors  finite; if there are none, all figures except `count` and `worst` are NaN.
ErrorFigures figures_of(const std::vector<double>& errors);

/// Returns a quantile of finite values; NaN if there are none.
/// @param share  fraction of the values that do not exceed the result, 0 to 1.
double quantile(std::vector<double> values, double share);

/// Reports the mean and RMS error and the mean, median, 95th percentile and maximum of |e| under
/// `name`, and adds a histogram up to twice the 95th percentile. Does nothing if there are no
/// errors.
void tell_errors(Section& into, const std::string& name, const std::string& unit,
                 const std::vector<double>& errors);

/// As tell_errors, for unsigned errors: lengths and angles.
void tell_sizes(Section& into, const std::string& name, const std::string& unit,
                const std::vector<double>& sizes);

}  // namespace groundray::golden
