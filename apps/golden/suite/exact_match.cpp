#include "apps/golden/suite/exact_match.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gnu/libc-version.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "apps/golden/false_colour.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

// FNV-1a hash of values that the C library's functions return. The library has several versions of
// them, for processors with and without fused multiply-add.
std::uint64_t print_of_functions() {
  std::uint64_t print = 0xcbf29ce484222325;
  const auto add = [&](double value) {
    print = (print ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001b3;
  };
  for (int i = 1; i <= 1000; ++i) {
    const double x = i / 1000.5;
    for (const double value :
         {std::sin(9 * x), std::cos(9 * x), std::tan(x), std::asin(x), std::acos(x),
          std::atan2(x, 0.3), std::exp(-5 * x), std::log(x), std::pow(x, 1.7), std::erf(x)}) {
      add(value);
    }
  }
  return print;
}

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
  return fmt::format("glibc {}, {} {}, {}, functions {:016x}", gnu_get_libc_version(),
#ifdef __clang__
                     "clang", __clang_major__,
#else
                     "gcc", __GNUC__,
#endif
#ifdef __x86_64__
                     "x86_64",
#else
                     "another processor",
#endif
                     print_of_functions());
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
