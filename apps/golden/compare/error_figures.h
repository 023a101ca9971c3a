#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "apps/golden/report.h"

namespace groundray::golden {

/// Statistics of a set of errors e. Quantiles are interpolated linearly between ranks, as in NumPy.
struct ErrorFigures {
  static constexpr double none = std::numeric_limits<double>::quiet_NaN();

  std::size_t count = 0;
  double mean = none;
  double rms = none;
  double mean_size = none;    ///< mean of |e|
  double median = none;       ///< median of e, with signs
  double median_size = none;  ///< median of |e|
  double p95_size = none;
  double p99_size = none;
  double largest = none;  ///< maximum of |e|
  std::size_t worst = 0;  ///< index of the first error of that magnitude
  double nmad = none;  ///< 1.4826 median |e - median|: the standard deviation if errors are normal
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

/// Side of the blocks of pixels whose means are tested in addition to single pixels.
inline constexpr int block_px = 8;

/// Returns the significance level of each of `tests` independent tests for which, without any
/// error, at least one of them fails with probability `level`.
/// @see Šidák, Rectangular confidence regions for the means of multivariate normal distributions,
///      JASA 62 (1967).
double significance_of_one(double level, std::size_t tests);

/// Returns the magnitude that a standard normal variable exceeds in at least one of `tests`
/// independent tests with probability `level`.
double normal_limit(double level, std::size_t tests);

/// As normal_limit, for Student's t.
/// @param freedom  degrees of freedom, at least 1.
double student_limit(double level, std::size_t tests, double freedom);

}  // namespace groundray::golden
