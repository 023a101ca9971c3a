#include "apps/golden/suite/check_case.h"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "apps/golden/suite/columns.h"
#include "apps/golden/suite/exact_match.h"
#include "apps/golden/suite/formula.h"
#include "apps/golden/suite/row_checks.h"
#include "apps/golden/suite/statistical_match.h"
#include "apps/golden/suite/stored.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

// Adds the position of each row: `row` from 0 and, for images, the pixel's `u` (to the right) and
// `v` (down).
void name_places(Columns& columns) {
  const auto add = [&](const char* name, const auto& place) {
    std::vector<double> values(columns.rows);
    for (std::size_t i = 0; i < columns.rows; ++i) values[i] = static_cast<double>(place(i));
    columns.all.push_back({name, std::move(values), Stored::Whole});
  };
  add("row", [](std::size_t i) { return i; });
  if (columns.size_px.x == 0) return;
  const auto width = static_cast<std::size_t>(columns.size_px.x);
  add("u", [width](std::size_t i) { return i % width; });
  add("v", [width](std::size_t i) { return i / width; });
}

// Drops the rows where the condition is 0.
void keep(const std::string& condition, Columns& columns) {
  const std::vector<double> kept = evaluate(condition, columns);
  std::size_t rows = 0;
  for (const double is_kept : kept) {
    if (std::isnan(is_kept)) throw Error("rows: '{}' is not a number in some row", condition);
    rows += is_kept != 0 ? 1 : 0;
  }
  for (Columns::Column& column : columns.all) {
    std::size_t to = 0;
    for (std::size_t from = 0; from < kept.size(); ++from) {
      if (kept[from] != 0) column.values[to++] = column.values[from];
    }
    column.values.resize(rows);
  }
  if (rows < columns.rows) columns.size_px = {0, 0};  // no longer an image
  columns.rows = rows;
}

// Returns the columns, with those that the case defines, of the rows that it selects.
Columns chosen(const ProductChecks& product, Columns columns) {
  name_places(columns);
  for (const auto& [name, formula] : product.names) {
    if (columns.find(name) != nullptr) throw Error("let: column '{}' already exists", name);
    columns.all.push_back({name, evaluate(formula, columns), Stored::Double});
  }
  if (!product.rows.empty()) keep(product.rows, columns);
  return columns;
}

struct Checker {
  const GoldenCase& golden;
  const ProductChecks& product;
  const Columns& whole;
  const Columns& rows;
  const std::string& because;
  Section& into;

  void operator()(const RowsCheck& check) const { check_rows(check, because, rows, into); }
  void operator()(const FigureCheck& check) const { check_figure(check, because, rows, into); }
  void operator()(const ExactCheck&) const {
    const Equal equal = stored_made_with(golden) == made_with() ? Equal::Bits : Equal::Nearly;
    check_equal(whole, read_columns(stored_file(golden, product.product)), equal, because, into);
  }
  void operator()(const StatisticalCheck& check) const {
    check_statistically(check, because, whole,
                        read_columns(stored_moments(golden, product.product)), into);
  }
};

void fail(const std::string& what, const std::string& why, Section& into) {
  hold(into, fmt::format("{}: {}", what, why), 1, "fault", 0, "");
}

void check_product(const GoldenCase& golden, const ProductChecks& product,
                   const std::filesystem::path& dataset, Section& into) {
  Columns whole, rows;
  try {
    whole = read_columns(dataset / product.product);
    rows = chosen(product, whole);
  } catch (const std::exception& fault) {
    return fail(product.product, fault.what(), into);
  }
  for (const Check& check : product.checks) {
    const std::size_t before = into.measures.size();
    try {
      std::visit(Checker{golden, product, whole, rows, check.because, into}, check.what);
    } catch (const std::exception& fault) {
      fail(fmt::format("check of line {}", check.line), fault.what(), into);
    }
    for (std::size_t i = before; i < into.measures.size(); ++i)
      into.measures[i].name = product.product + ": " + into.measures[i].name;
  }
}

}  // namespace

Section check_case(const GoldenCase& golden, const std::filesystem::path& dataset) {
  Section section{.title = golden.name, .text = golden.title};
  for (const ProductChecks& product : golden.products)
    check_product(golden, product, dataset, section);
  section.verdict = verdict_of(section.measures);
  return section;
}

}  // namespace groundray::golden
