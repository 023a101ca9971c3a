#include "apps/golden/suite/formula.h"

#include <muParser.h>

#include <cmath>
#include <numbers>
#include <string_view>

#include "core/error.h"

namespace groundray::golden {
namespace {

double floor_of(double value) { return std::floor(value); }
double cbrt_of(double value) { return std::cbrt(value); }
double erf_of(double value) { return std::erf(value); }
double mod_of(double x, double y) { return x - y * std::floor(x / y); }
double hypot_of(double x, double y) { return std::hypot(x, y); }

// muParser takes pointers to variables that it could modify.
void define(mu::Parser& parser, const std::string& name, const std::vector<double>& values) {
  parser.DefineVar(name, const_cast<double*>(values.data()));
}

// muParser would read `=` as an assignment, and evaluate `a, b` to the last value.
void check_spelling(const std::string& formula) {
  int depth = 0;
  for (std::size_t i = 0; i < formula.size(); ++i) {
    const char c = formula[i];
    if (c == '(') ++depth;
    if (c == ')') --depth;
    if (c == ',' && depth <= 0) throw Error("formula '{}': has a comma between values", formula);
    if (c != '=') continue;
    const bool ends = i > 0 && std::string_view("=<>!").find(formula[i - 1]) != std::string::npos;
    const bool begins = i + 1 < formula.size() && formula[i + 1] == '=';
    if (!ends && !begins) throw Error("formula '{}': has '=': equality is '=='", formula);
  }
}

}  // namespace

std::vector<double> evaluate(const std::string& formula, const Columns& columns) {
  std::vector<double> values(columns.rows);
  check_spelling(formula);
  if (columns.rows == 0) return values;
  try {
    mu::Parser parser;
    parser.DefineFun("floor", floor_of);
    parser.DefineFun("cbrt", cbrt_of);
    parser.DefineFun("erf", erf_of);
    parser.DefineFun("hypot", hypot_of);
    parser.DefineFun("mod", mod_of);
    parser.DefineConst("pi", std::numbers::pi);
    for (const Columns::Column& column : columns.all) define(parser, column.name, column.values);
    parser.SetExpr(formula);
    parser.Eval(values.data(), static_cast<int>(values.size()));
  } catch (const mu::Parser::exception_type& fault) {
    throw Error("formula '{}': {}", formula, fault.GetMsg());
  }
  return values;
}

}  // namespace groundray::golden
