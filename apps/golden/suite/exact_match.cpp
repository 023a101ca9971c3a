#include "apps/golden/suite/exact_match.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gnu/libc-version.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "apps/golden/suite/false_colour.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

std::vector<std::string> names_of(const Columns& columns) {
  std::vector<std::string> names;
  for (const Columns::Column& column : columns.all) names.push_back(column.name);
  return names;
}

bool are_equal(double a, double b, Stored stored, Equal equal) {
  if (a == b || (std::isnan(a) && std::isnan(b))) return true;
  if (equal == Equal::Bits || stored == Stored::Whole) return false;
  if (stored == Stored::Double)
    return std::abs(a - b) <= 1e-12 * std::max(std::abs(a), std::abs(b));
  const auto from = static_cast<float>(a);
  const auto to = static_cast<float>(b);
  return std::nextafter(from, to) == to;
}

}  // namespace

std::string made_with() {
  return fmt::format("glibc {}, {} {}", gnu_get_libc_version(),
#ifdef __clang__
                     "clang", __clang_major__
#else
                     "gcc", __GNUC__
#endif
  );
}

void check_equal(const Columns& columns, const Columns& stored, Equal equal,
                 const std::string& because, Section& into) {
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
      if (are_equal(column.values[i], expected.values[i], expected.stored, equal)) continue;
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
