#include "apps/dataset/range_conf.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"

namespace groundray::range_conf_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string refusal(const std::string& text) {
  try {
    parse_conf(text, "some.conf");
  } catch (const Error& fault) {
    return fault.what();
  }
  return "";
}

// The file's quaternion is a quarter turn about z that maps D's x axis to the scan's y axis. The
// scan's y axis therefore lies along D's x axis: p_D = R^T p_S + t.
TEST(RangeConf, InvertsTheRotationsOfTheFile) {
  const double half = std::numbers::sqrt2 / 2;
  const auto scans = parse_conf(
      "camera 1 2 3 0 0 0 1\nmesh bun.ply 0 0 0 0 0 0 1\n\n"
      "bmesh bun000.ply 0 0 0 0 0 0 1\r\n"
      "  bmesh\tbun045.ply  0.5 -1e-2 3 0 0 0.70710678 0.70710678\n",
      "bun.conf");
  ASSERT_EQ(scans.size(), 2u);
  EXPECT_EQ(scans[0].file, "bun000.ply");
  EXPECT_EQ(scans[0].X_DS, Pose{});
  EXPECT_EQ(scans[1].file, "bun045.ply");
  EXPECT_EQ(scans[1].X_DS.translation_m, glm::dvec3(0.5, -0.01, 3));
  const glm::dvec3 y_of_scan = scans[1].X_DS.rotation * glm::dvec3(0, 1, 0);
  EXPECT_NEAR(std::abs(y_of_scan.x), 2 * half * half, 1e-7);
  EXPECT_GT(y_of_scan.x, 0);
}

TEST(RangeConf, NormalisesRoundedQuaternions) {
  const auto scans = parse_conf("bmesh a 0 0 0 0.056 0.168 0 0.984\n", "a.conf");
  ASSERT_EQ(scans.size(), 1u);
  EXPECT_NEAR(glm::length(scans[0].X_DS.rotation), 1, 1e-15);
}

TEST(RangeConf, ErrorsNameLineAndRule) {
  const std::vector<std::pair<std::string, std::string>> bad{
      {"bmesh a 1 2 3 0 0 0", "must be `bmesh FILE tx ty tz qx qy qz qw`"},
      {"bmesh a 1 2 3 0 0 0 1 7", "must be `bmesh"},
      {"bmesh a 1 2 x 0 0 0 1", "must be `bmesh"},
      {"bmesh a 1 2 nan 0 0 0 1", "must be `bmesh"},
      {"bmesh a 1 2 inf 0 0 0 1", "numbers within 1e+15"},
      {"bmesh a 1 2 1e16 0 0 0 1", "numbers within 1e+15"},
      {"bmesh a 1 2 3 0 0 0 0", "length of its quaternion is 0; it must be 1"},
      {"bmesh a 1 2 3 0 0 0 1.01", "length of its quaternion is 1.01"}};
  for (const auto& [line, rule] : bad) {
    EXPECT_THAT(refusal("camera 0\nbmesh b 0 0 0 0 0 0 1\n" + line + "\n"),
                AllOf(HasSubstr("some.conf:3"), HasSubstr(rule)))
        << line;
  }
}

TEST(RangeConf, IgnoresOtherLines) {
  for (const std::string text : {"", "\n", "bmeshes a 0 0 0 0 0 0 1", "# bmesh a 0", "\0\xff"})
    EXPECT_TRUE(parse_conf(text, "a.conf").empty());
}

}  // namespace
}  // namespace groundray::range_conf_test
