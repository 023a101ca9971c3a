#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "apps/golden/report.h"

namespace groundray::golden {

/// What a set of errors comes to. Quantiles lie on straight lines between ranks, as NumPy's do.
struct ErrorFigures {
  std::size_t count = 0;
  double mean = 0;
  double rms = 0;
  double mean_size = 0;    ///< of |e|
  double median = 0;       ///< of e, signs included
  double median_size = 0;  ///< of |e|
  double p95_size = 0;
  double p99_size = 0;
  double largest = 0;     ///< |e|
  std::size_t worst = 0;  ///< the first error of that size
  double nmad = 0;  ///< 1.4826 median |e - median|: the standard deviation, if errors are normal
};

/// @param errors  all finite. @return of none, NaN for all but the count.
ErrorFigures figures_of(const std::vector<double>& errors);

/// Returns the value that a share of `values`, all finite, do not exceed; NaN, of none.
double quantile(std::vector<double> values, double share);

/// Tells bias, RMS, median, 95th percentile and largest error under `name`, and draws how the
/// errors are spread, up to twice the 95th percentile; nothing if there is no error.
void tell_errors(Section& into, const std::string& name, const std::string& unit,
                 const std::vector<double>& errors);

/// As tell_errors, of errors without a sign: lengths and angles.
void tell_sizes(Section& into, const std::string& name, const std::string& unit,
                const std::vector<double>& sizes);

}  // namespace groundray::golden
