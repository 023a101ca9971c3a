#include "apps/golden/suite/checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "apps/golden/compare/images/difference_picture.h"
#include "apps/golden/suite/columns.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

struct Difference {
  std::vector<double> of_rows;    // value - expected
  std::vector<double> tolerance;  // of each row
  std::size_t beyond = 0;         // number of rows beyond the tolerance
  std::size_t worst = 0;          // row with the largest fraction of its tolerance
};

// Infinite values must be equal, and NaN equals nothing: other differences are infinite.
double difference(double value, double expected) {
  if (value == expected) return 0;
  const double apart = value - expected;
  return std::isfinite(apart) ? apart : std::numeric_limits<double>::infinity();
}

// An infinite tolerance permits only equal values, and NaN permits none.
bool is_within(double apart, double tolerance) {
  return apart == 0 ? tolerance >= 0 : std::isfinite(tolerance) && std::abs(apart) <= tolerance;
}

Difference differences(const std::vector<double>& values, const std::vector<double>& expected,
                       std::vector<double> tolerance) {
  Difference found{.of_rows = std::vector<double>(values.size()),
                   .tolerance = std::move(tolerance)};
  double largest = -1;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double apart = found.of_rows[i] = difference(values[i], expected[i]);
    const bool holds = is_within(apart, found.tolerance[i]);
    if (!holds) ++found.beyond;
    // Fraction of the tolerance that is used: 0, not 0 / 0, for equal values without tolerance.
    const double used = apart == 0 ? (holds ? 0 : std::numeric_limits<double>::infinity())
                                   : std::abs(apart) / std::max(found.tolerance[i],
                                                                std::numeric_limits<double>::min());
    if (used > largest) {
      largest = used;
      found.worst = i;
    }
  }
  return found;
}

void draw_difference(const std::string& what, const std::vector<double>& values,
                     const std::vector<double>& expected, const Difference& found,
                     const Columns& columns, Section& into) {
  double widest = 0;
  for (const double tolerance : found.tolerance) {
    if (std::isfinite(tolerance)) widest = std::max(widest, 2 * tolerance);
  }
  into.histograms.push_back(
      histogram_of(what + ": value - expected", "", found.of_rows, -widest, widest));
  if (columns.size_px.x == 0) return;
  const auto [low, high] = finite_range(expected);
  into.pictures.push_back({fmt::format("{}: expected, {:.6g} to {:.6g}", what, low, high),
                           false_colour(expected, columns.size_px, low, high)});
  into.pictures.push_back({what + ": actual", false_colour(values, columns.size_px, low, high)});
  into.pictures.push_back({fmt::format("{}: difference, -{:.3g} to {:.3g}", what, widest, widest),
                           false_colour(found.of_rows, columns.size_px, -widest, widest)});
}

void refuse_nan(const std::string& formula, const std::vector<double>& values) {
  const auto bad = std::ranges::find_if(values, [](double value) { return std::isnan(value); });
  if (bad != values.end())
    throw Error("formula '{}': is not a number in row {}", formula, bad - values.begin());
}

double sum_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

double figure_of(FigureCheck::Kind kind, const std::vector<double>& values) {
  const auto rows = static_cast<double>(values.size());
  switch (kind) {
    case FigureCheck::Kind::Count:
      return rows;
    case FigureCheck::Kind::Mean:
      return sum_of(values) / rows;
    case FigureCheck::Kind::Smallest:
      return *std::ranges::min_element(values);
    case FigureCheck::Kind::Largest:
      return *std::ranges::max_element(values);
    case FigureCheck::Kind::Deviation:
      break;
  }
  const double mean = sum_of(values) / rows;
  const double squares = std::accumulate(
      values.begin(), values.end(), 0.0,
      [&](double sum, double value) { return sum + (value - mean) * (value - mean); });
  return std::sqrt(squares / (rows - 1));
}

const char* word_of(FigureCheck::Kind kind) {
  constexpr std::array words{"number of rows", "mean of", "standard deviation of", "smallest",
                             "largest"};
  return words[static_cast<std::size_t>(kind)];
}

// Evaluates a formula of the number of rows.
double number_of(const std::string& formula, std::size_t rows) {
  const Columns one{.rows = 1, .all = {{"rows", {static_cast<double>(rows)}, Stored::Whole}}};
  return evaluate(formula, one).front();
}

std::vector<std::string> names_of(const Columns& columns) {
  std::vector<std::string> names;
  for (const Columns::Column& column : columns.all) names.push_back(column.name);
  return names;
}

bool are_equal(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

}  // namespace

void check_rows(const RowsCheck& check, const std::string& because, const Columns& columns,
                Section& into) {
  const std::string what = fmt::format("{} = {}", check.value, check.is);
  if (columns.rows == 0) throw Error("{}: there is no row to check", what);
  const std::vector<double> values = evaluate(check.value, columns);
  const std::vector<double> expected = evaluate(check.is, columns);
  const Difference found = differences(values, expected, evaluate(check.within, columns));
  const double at_most = std::floor(static_cast<double>(columns.rows) * (1 - check.share) *
                                    (1 + 1e-12));  // because 1 - 0.9 is rounded to less than 0.1
  hold(into, fmt::format("{}, rows beyond {}", what, check.within),
       static_cast<double>(found.beyond), fmt::format("of {}", columns.rows), at_most, because);
  into.measures.push_back(
      {.name = fmt::format("at row {}, the worst: {:.17g} for {:.17g}; off by", found.worst,
                           values[found.worst], expected[found.worst]),
       .value = std::abs(found.of_rows[found.worst]),
       .unit = "",
       .limit = found.tolerance[found.worst],
       .because = "",
       .verdict = Verdict::Told});
  draw_difference(what, values, expected, found, columns, into);
}

void check_figure(const FigureCheck& check, const std::string& because, const Columns& columns,
                  Section& into) {
  const bool counts = check.kind == FigureCheck::Kind::Count;
  if (!counts && columns.rows == 0)
    throw Error("{} {}: there is no row", word_of(check.kind), check.value);
  const std::vector<double> values =
      counts ? std::vector<double>(columns.rows) : evaluate(check.value, columns);
  refuse_nan(check.value, values);
  const double figure = figure_of(check.kind, values);
  const double expected = number_of(check.is, columns.rows);
  const double tolerance = number_of(check.within, columns.rows);
  const double apart = std::abs(difference(figure, expected));
  if (!std::isfinite(tolerance)) throw Error("within '{}': must be finite", check.within);
  hold(into,
       fmt::format("{} {} = {}: {:.10g} for {:.10g}; off by", word_of(check.kind), check.value,
                   check.is, figure, expected),
       apart, "", tolerance, because);
}

void check_equal(const Columns& columns, const Columns& stored, const std::string& because,
                 Section& into) {
  if (names_of(columns) != names_of(stored)) {
    throw Error("it has the columns {}; those stored are {}", fmt::join(names_of(columns), " "),
                fmt::join(names_of(stored), " "));
  }
  if (columns.rows != stored.rows || columns.size_px != stored.size_px) {
    throw Error("it has {} rows; {} are stored", columns.rows, stored.rows);
  }
  for (std::size_t k = 0; k < columns.all.size(); ++k) {
    const auto& column = columns.all[k];
    const auto& expected = stored.all[k];
    std::size_t unequal = 0;
    double largest = 0;
    std::vector<double> apart(columns.rows);
    for (std::size_t i = 0; i < columns.rows; ++i) {
      if (are_equal(column.values[i], expected.values[i])) continue;
      ++unequal;
      const double off = std::abs(column.values[i] - expected.values[i]);
      apart[i] = std::isfinite(off) ? off : std::numeric_limits<double>::infinity();
      largest = std::max(largest, apart[i]);
    }
    const bool holds = unequal == 0 && column.stored == expected.stored;
    into.measures.push_back(
        {.name = fmt::format("{}, values that differ{}", column.name,
                             holds ? "" : fmt::format(", by up to {:.3g}", largest)),
         .value = static_cast<double>(unequal),
         .unit = fmt::format("of {}", columns.rows),
         .limit = 0,
         .because = because,
         .verdict = holds ? Verdict::Passed : Verdict::Failed});
    if (holds || columns.size_px.x == 0) continue;
    const auto [low, high] = finite_range(expected.values);
    into.pictures.push_back(
        {column.name + ": expected", false_colour(expected.values, columns.size_px, low, high)});
    into.pictures.push_back(
        {column.name + ": actual", false_colour(column.values, columns.size_px, low, high)});
    into.pictures.push_back({fmt::format("{}: difference, 0 to {:.3g}", column.name, largest),
                             false_colour(apart, columns.size_px, 0, largest)});
  }
}

}  // namespace groundray::golden
