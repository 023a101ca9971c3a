#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/golden/report.h"
#include "apps/golden/suite/columns.h"
#include "apps/golden/suite/golden_case.h"

namespace groundray::golden {

/// Checks each row's value against its formula; adds pictures if the rows are pixels. Infinite
/// values must be equal, and NaN never passes.
/// @throws Error as evaluate, or if there are no rows.
void check_rows(const RowsCheck& check, const std::string& because, const Columns& columns,
                Section& into);

/// Checks a statistic of all rows against a number.
/// @throws Error as evaluate; if a value is NaN, the tolerance is not finite, or, except for a
///         count, there are no rows.
void check_figure(const FigureCheck& check, const std::string& because, const Columns& columns,
                  Section& into);

/// Compares a product with a stored one, column by column: all values must be equal; NaN equals
/// NaN.
/// @throws Error if the names of their columns or their sizes differ.
void check_equal(const Columns& columns, const Columns& stored, const std::string& because,
                 Section& into);

/// Number of runs, with different seeds, behind a stored mean and variance.
inline constexpr int statistical_runs = 64;

/// Mean and variance of the values of a product over several runs: columns `Mean_<name>` and
/// `Variance_<name>`.
class Moments {
 public:
  explicit Moments(std::vector<std::string> columns) : names_(std::move(columns)) {}

  /// Adds a run.
  /// @throws Error if the product lacks a column, is not an image, or differs in size from earlier
  ///         ones.
  void add(const Columns& product);

  /// Returns the columns; the variance is the unbiased one of a single run. Requires at least two
  /// runs.
  /// @throws Error if a value is not finite.
  Columns columns() const;

 private:
  std::vector<std::string> names_;
  int runs_ = 0;
  Columns mean_;  // means alternate with sums of squared deviations
};

/// Tests an image against stored moments: each value by Student's t, and the means of each block of
/// 8 x 8 pixels and of each whole channel by the normal distribution, at a significance of 1 % for
/// all tests of a kind (Šidák's correction). Tests of single values are insensitive to a small
/// error of the whole image.
/// @throws Error if columns are missing or sizes differ.
/// @see Šidák, Rectangular confidence regions for the means of multivariate normal distributions
///      (1967).
void check_statistically(const StatisticalCheck& check, const std::string& because,
                         const Columns& image, const Columns& moments, Section& into);

}  // namespace groundray::golden
