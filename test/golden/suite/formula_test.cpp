#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "apps/golden/suite/columns.h"
#include "core/error.h"

namespace groundray::golden::formula_test {
namespace {

Columns two_columns() {
  return {.rows = 3, .all = {{"x", {1, 2, 3}, Stored::Double}, {"ring", {0, 1, 2}, Stored::Whole}}};
}

TEST(Formula, EvaluatesEachRow) {
  EXPECT_THAT(evaluate("x^2 + 10 * ring", two_columns()), testing::ElementsAre(1, 14, 29));
  EXPECT_THAT(evaluate("ring == 1 ? -x : x", two_columns()), testing::ElementsAre(1, -2, 3));
  EXPECT_THAT(evaluate("mod(x - 4, 2)", two_columns()), testing::ElementsAre(1, 0, 1));
  EXPECT_THAT(evaluate("7", two_columns()), testing::ElementsAre(7, 7, 7));
}

TEST(Formula, HasTheDocumentedFunctions) {
  const Columns one{.rows = 1, .all = {{"x", {0.3}, Stored::Double}}};
  const auto value = [&](const char* formula) { return evaluate(formula, one).front(); };
  EXPECT_DOUBLE_EQ(value("sin(x) + cos(x) * tan(x)"), 2 * std::sin(0.3));
  EXPECT_DOUBLE_EQ(value("atan2(x, -1)"), std::atan2(0.3, -1));
  EXPECT_DOUBLE_EQ(value("asin(x) + acos(x)"), std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(value("exp(ln(x)) + log10(100)"), 2.3);
  EXPECT_DOUBLE_EQ(value("hypot(3 * x, 4 * x)"), 1.5);
  EXPECT_DOUBLE_EQ(value("cbrt(27 * x^3) + sqrt(x^2)"), 1.2);
  EXPECT_DOUBLE_EQ(value("erf(x)"), std::erf(0.3));
  EXPECT_DOUBLE_EQ(value("floor(-x) + rint(0.7) + abs(-2) + sign(-x)"), 1);
  EXPECT_DOUBLE_EQ(value("min(x, 1, 2) + max(x, 1)"), 1.3);
  EXPECT_DOUBLE_EQ(value("2 * pi"), 2 * std::numbers::pi);
}

TEST(Formula, ReportsSyntaxErrors) {
  const auto message = [](const char* formula) {
    try {
      evaluate(formula, two_columns());
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(message("x + rong"), testing::HasSubstr("formula 'x + rong': "));
  EXPECT_THAT(message("x + rong"), testing::HasSubstr("\"rong\""));
  EXPECT_THAT(message("sin(x"), testing::HasSubstr("parenthesis"));
  EXPECT_THAT(message(""), testing::HasSubstr("formula ''"));
  // An assignment would change the column and count as true; of several values, the last would
  // count.
  EXPECT_THAT(message("ring = 1"), testing::HasSubstr("equality is '=='"));
  EXPECT_THAT(message("x, ring"), testing::HasSubstr("comma"));
  EXPECT_EQ(message("ring == 1 || x <= 2 && x >= 1 && x != 7"), "");
}

TEST(Formula, IsEmptyForAnEmptyTable) { EXPECT_TRUE(evaluate("x", {.rows = 0}).empty()); }

}  // namespace
}  // namespace groundray::golden::formula_test
