#pragma once

#include <string>
#include <vector>

#include "apps/golden/report.h"
#include "apps/golden/suite/columns.h"
#include "apps/golden/suite/golden_case.h"

namespace groundray::golden {

/// How many runs with seeds of their own are behind a stored mean and variance.
inline constexpr int statistical_runs = 64;

/// Mean and variance of the runs of a product, value by value: columns `Mean_<name>` and
/// `Variance_<name>`.
class Moments {
 public:
  explicit Moments(std::vector<std::string> columns) : names_(std::move(columns)) {}

  /// @throws Error if the product lacks a column, is no image, or of another size than those
  /// before.
  void add(const Columns& product);

  /// The variance is that of one run, unbiased. Two runs at least.
  Columns columns() const;

 private:
  std::vector<std::string> names_;
  int runs_ = 0;
  Columns mean_;  // and sum of squares about it, by turns
};

/// Holds an image against stored moments, by Student's t: each value, each block of 8 x 8 pixels
/// and each whole channel, at a significance of 1 % for all of a kind (Šidák's correction).
/// Single values alone are blind for what is everywhere a little wrong.
/// @throws Error if columns are missing or sizes differ.
/// @see Šidák, Rectangular confidence regions for the means of multivariate normal distributions
///      (1967).
void check_statistically(const StatisticalCheck& check, const std::string& because,
                         const Columns& image, const Columns& moments, Section& into);

}  // namespace groundray::golden
