#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "apps/golden/suite/checks.h"
#include "core/error.h"

namespace groundray::golden::exact_match_test {
namespace {

Columns one(double value, Stored stored) { return {.rows = 1, .all = {{"x", {value}, stored}}}; }

Verdict match(double value, double stored, Stored type) {
  Section section;
  check_equal(one(value, type), one(stored, type), "", section);
  return section.measures.front().verdict;
}

TEST(ExactMatch, DetectsADifferenceInTheLastBit) {
  const double next = std::nextafter(1.0, 2.0);
  EXPECT_EQ(match(1, 1, Stored::Double), Verdict::Passed);
  EXPECT_EQ(match(next, 1, Stored::Double), Verdict::Failed);
  EXPECT_EQ(match(NAN, NAN, Stored::Double), Verdict::Passed);
  EXPECT_EQ(match(NAN, 1, Stored::Double), Verdict::Failed);
}

TEST(ExactMatch, RejectsAnotherType) {
  Section section;
  check_equal(one(1, Stored::Double), one(1, Stored::Float), "", section);
  EXPECT_EQ(section.measures.front().verdict, Verdict::Failed);
}

TEST(ExactMatch, ReportsDifferencesInColumnsAndRows) {
  const auto message = [](const Columns& columns) {
    Section section;
    try {
      check_equal(columns, one(1, Stored::Double), "", section);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(message({.rows = 1, .all = {{"y", {1}, Stored::Double}}}),
              testing::HasSubstr("it has the columns y; those stored are x"));
  EXPECT_THAT(message({.rows = 2, .all = {{"x", {1, 2}, Stored::Double}}}),
              testing::HasSubstr("it has 2 rows; 1 are stored"));
}

}  // namespace
}  // namespace groundray::golden::exact_match_test
