#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "apps/golden/suite/checks.h"
#include "core/error.h"

namespace groundray::golden::exact_match_test {
namespace {

Columns one(double value, Stored stored) { return {.rows = 1, .all = {{"x", {value}, stored}}}; }

Verdict match(double value, double stored, Stored type, Equal equal) {
  Section section;
  check_equal(one(value, type), one(stored, type), equal, "", section);
  return section.measures.front().verdict;
}

TEST(ExactMatch, DetectsADifferenceInTheLastBit) {
  const double next = std::nextafter(1.0, 2.0);
  EXPECT_EQ(match(1, 1, Stored::Double, Equal::Bits), Verdict::Passed);
  EXPECT_EQ(match(next, 1, Stored::Double, Equal::Bits), Verdict::Failed);
  EXPECT_EQ(match(NAN, NAN, Stored::Double, Equal::Bits), Verdict::Passed);
  EXPECT_EQ(match(NAN, 1, Stored::Double, Equal::Bits), Verdict::Failed);
}

TEST(ExactMatch, NearlyEqualAllowsRoundingOfAnotherLibrary) {
  EXPECT_EQ(match(1 + 9e-13, 1, Stored::Double, Equal::Nearly), Verdict::Passed);
  EXPECT_EQ(match(1 + 3e-12, 1, Stored::Double, Equal::Nearly), Verdict::Failed);
  const float neighbour = std::nextafter(1.0F, 2.0F);
  EXPECT_EQ(match(neighbour, 1, Stored::Float, Equal::Nearly), Verdict::Passed);
  EXPECT_EQ(match(std::nextafter(neighbour, 2.0F), 1, Stored::Float, Equal::Nearly),
            Verdict::Failed);
  EXPECT_EQ(match(2, 1, Stored::Whole, Equal::Nearly), Verdict::Failed);
}

TEST(ExactMatch, RejectsAnotherType) {
  Section section;
  check_equal(one(1, Stored::Double), one(1, Stored::Float), Equal::Bits, "", section);
  EXPECT_EQ(section.measures.front().verdict, Verdict::Failed);
}

TEST(ExactMatch, ReportsDifferencesInColumnsAndRows) {
  const auto message = [](const Columns& columns) {
    Section section;
    try {
      check_equal(columns, one(1, Stored::Double), Equal::Bits, "", section);
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
