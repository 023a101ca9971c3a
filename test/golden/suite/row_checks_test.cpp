#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "apps/golden/suite/checks.h"
#include "core/error.h"

namespace groundray::golden::row_checks_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
const double nan = std::nan("");

Columns column(std::vector<double> values) {
  const std::size_t rows = values.size();
  return {.rows = rows, .all = {{"x", std::move(values), Stored::Double}}};
}

Section rows_section(const RowsCheck& check, const Columns& columns) {
  Section section;
  check_rows(check, "said so", columns, section);
  return section;
}

Verdict figure(const FigureCheck& check, const Columns& columns) {
  Section section;
  check_figure(check, "said so", columns, section);
  return section.measures.front().verdict;
}

TEST(RowChecks, CountRowsBeyondTheTolerance) {
  const Columns columns = column({1, 2, 3.5, 4.25});
  const Section section =
      rows_section({.value = "x", .is = "rint(x)", .within = "0.25 * (x > 3)"}, columns);
  EXPECT_EQ(section.measures[0].value, 1);
  EXPECT_EQ(section.measures[0].verdict, Verdict::Failed);
  EXPECT_EQ(section.measures[0].because, "said so");
  EXPECT_THAT(section.measures[1].name, ::testing::HasSubstr("at row 2"));
  EXPECT_DOUBLE_EQ(section.measures[1].value, 0.5);
  EXPECT_DOUBLE_EQ(section.measures[1].limit.value(), 0.25);
}

TEST(RowChecks, PassAtTheToleranceAndFailJustBeyond) {
  const auto verdict = [](double value) {
    return rows_section({.value = "x", .is = "0", .within = "0.5"}, column({value}))
        .measures[0]
        .verdict;
  };
  EXPECT_EQ(verdict(0.5), Verdict::Passed);
  EXPECT_EQ(verdict(-0.5), Verdict::Passed);
  EXPECT_EQ(verdict(std::nextafter(0.5, 1)), Verdict::Failed);
}

TEST(RowChecks, NonFiniteValuesMustBeEqual) {
  const auto verdict = [](double value, const char* is) {
    return rows_section({.value = "x", .is = is, .within = "1e9"}, column({value}))
        .measures[0]
        .verdict;
  };
  EXPECT_EQ(verdict(infinity, "1 / 0"), Verdict::Passed);
  EXPECT_EQ(verdict(-infinity, "1 / 0"), Verdict::Failed);
  EXPECT_EQ(verdict(nan, "0"), Verdict::Failed);
  EXPECT_EQ(verdict(0, "0 / 0"), Verdict::Failed);
  EXPECT_EQ(verdict(nan, "0 / 0"), Verdict::Failed);  // NaN always fails
}

TEST(RowChecks, InfiniteToleranceRequiresEquality) {
  const auto verdict = [](double value, const char* is) {
    return rows_section({.value = "x", .is = is, .within = "1 / 0"}, column({value}))
        .measures[0]
        .verdict;
  };
  EXPECT_EQ(verdict(1, "0"), Verdict::Failed);
  EXPECT_EQ(verdict(1, "1 / 0"), Verdict::Failed);
  EXPECT_EQ(verdict(infinity, "1 / 0"), Verdict::Passed);
  EXPECT_THROW(figure({.value = "x", .is = "0", .within = "1 / 0"}, column({1})), Error);
}

TEST(RowChecks, RejectStatisticsOfNaN) {
  using Kind = FigureCheck::Kind;
  for (const Kind kind : {Kind::Mean, Kind::Deviation, Kind::Smallest, Kind::Largest}) {
    EXPECT_THROW(figure({.kind = kind, .value = "x", .is = "1", .within = "9"}, column({1, nan})),
                 Error);
  }
}

TEST(RowChecks, NaNToleranceFails) {
  EXPECT_EQ(
      rows_section({.value = "x", .is = "0", .within = "0 / 0"}, column({1})).measures[0].verdict,
      Verdict::Failed);
}

TEST(RowChecks, AllowAFractionOfRowsBeyondTheTolerance) {
  const Columns columns = column({0, 0, 0, 0, 0, 0, 0, 0, 9, 9});
  const auto verdict = [&](double share) {
    return rows_section({.value = "x", .is = "0", .within = "1", .share = share}, columns)
        .measures[0]
        .verdict;
  };
  EXPECT_EQ(verdict(0.8), Verdict::Passed);
  EXPECT_EQ(verdict(0.81), Verdict::Failed);
}

TEST(RowChecks, RejectEmptyTables) {
  EXPECT_THROW(rows_section({.value = "x", .is = "0", .within = "1"}, column({})), Error);
  EXPECT_THROW(figure({.value = "x", .is = "0", .within = "1"}, column({})), Error);
}

TEST(RowChecks, StatisticsMatchTheirDefinitions) {
  using Kind = FigureCheck::Kind;
  const Columns columns = column({2, 4, 4, 4, 5, 5, 7, 9});  // sum 40, squared deviations 32
  const auto holds = [&](Kind kind, const char* is) {
    return figure({.kind = kind, .value = "x", .is = is, .within = "1e-15"}, columns) ==
           Verdict::Passed;
  };
  EXPECT_TRUE(holds(Kind::Mean, "5"));
  EXPECT_FALSE(holds(Kind::Mean, "5.001"));
  EXPECT_TRUE(holds(Kind::Deviation, "sqrt(32 / (rows - 1))"));
  EXPECT_TRUE(holds(Kind::Smallest, "2"));
  EXPECT_TRUE(holds(Kind::Largest, "9"));
  EXPECT_TRUE(holds(Kind::Count, "8"));
  EXPECT_FALSE(holds(Kind::Count, "7"));
}

TEST(RowChecks, DrawImages) {
  Columns image = column({0, 1, 2, 3});
  image.size_px = {2, 2};
  const Section section = rows_section({.value = "x", .is = "x", .within = "0"}, image);
  EXPECT_EQ(section.pictures.size(), 3U);  // expected, actual, difference
  EXPECT_EQ(section.histograms.size(), 1U);
}

}  // namespace
}  // namespace groundray::golden::row_checks_test
