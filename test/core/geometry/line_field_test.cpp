#include "core/geometry/line_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/random.h"

namespace groundray::line_field_test {
namespace {

constexpr double radius_m = 6;
constexpr double turn_rad = 1.5 * std::numbers::pi;

// Part of a circle about the origin, counter-clockwise from (radius, 0).
TangentLine arc() {
  constexpr int pieces = 60;
  TangentLine line{.points_m = {}, .tangents = {}, .spacing_m = radius_m * turn_rad / pieces};
  for (int i = 0; i <= pieces; ++i) {
    const double angle_rad = turn_rad * i / pieces;
    line.points_m.push_back(radius_m * glm::dvec2(std::cos(angle_rad), std::sin(angle_rad)));
    line.tangents.emplace_back(-std::sin(angle_rad), std::cos(angle_rad));
  }
  return line;
}

// A cubic Hermite piece of length h follows a circle to h^4 / (384 r^3): 1e-6 m here. Places beside
// it are closed forms: the radius and the angle.
TEST(LineField, PlacesBesideACircleAreThoseOfItsClosedForm) {
  const LineField field(arc(), 4);
  int found = 0;
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    const glm::dvec2 p = 24.0 * random_uniform({Seed{5}, 0, 0, i}) - 12.0;
    double angle_rad = std::atan2(p.y, p.x);
    if (angle_rad < 0) angle_rad += 2 * std::numbers::pi;
    if (angle_rad > turn_rad) continue;                 // beside an end
    const double across_m = radius_m - glm::length(p);  // the centre is to the left
    const auto place = field.place(p);
    if (std::abs(across_m) > 4.001) {
      ASSERT_FALSE(place) << i;
    }
    if (std::abs(across_m) > 3.999) continue;
    ASSERT_TRUE(place) << i;
    ASSERT_NEAR(place->across_m, across_m, 2e-6) << i;
    // One step of Newton leaves less than a tenth of a millimetre, even near the centre.
    ASSERT_NEAR(place->along_m, radius_m * angle_rad, 1e-4) << i;
    ++found;
  }
  EXPECT_GT(found, 5000);
}

// The nearest of all points is found also from far away, where most points are skipped.
TEST(LineField, FindsTheNearestPointWithinALargeReach) {
  TangentLine line{.points_m = {}, .tangents = {}, .spacing_m = 0.5};
  glm::dvec2 p_m(0);
  for (int i = 0; i < 2000; ++i) {  // it winds
    const double angle_rad = 2 * std::sin(i * 0.02) + 0.5 * std::sin(i * 0.11);
    line.points_m.push_back(p_m);
    line.tangents.emplace_back(std::cos(angle_rad), std::sin(angle_rad));
    p_m += line.spacing_m * line.tangents.back();
  }
  const LineField field(line, 400);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const glm::dvec2 p = 900.0 * random_uniform({Seed{6}, 0, 0, i}) - 300.0;
    double least_m = 1e9, at_m = 0;
    for (std::size_t k = 0; k < line.points_m.size(); ++k) {
      const double distance_m = glm::distance(p, line.points_m[k]);
      if (distance_m < least_m) at_m = 0.5 * static_cast<double>(k);
      least_m = std::min(least_m, distance_m);
    }
    const auto place = field.place(p);
    if (least_m < 399) {
      ASSERT_TRUE(place) << i;
    }
    if (!place) continue;
    ASSERT_LE(std::abs(place->across_m), least_m * (1 + 1e-12)) << i;
    ASSERT_NEAR(place->along_m, at_m, line.spacing_m) << i;
  }
}

TEST(LineField, PlacesBeyondTheEndsAreThoseOfTheEnds) {
  const LineField field(
      {.points_m = {{0, 0}, {2, 0}, {4, 0}}, .tangents = {{1, 0}, {1, 0}, {1, 0}}, .spacing_m = 2},
      3);
  const auto before = field.place({-1, 1}), after = field.place({5, -1});
  ASSERT_TRUE(before && after);
  EXPECT_EQ(before->along_m, 0);
  EXPECT_DOUBLE_EQ(before->across_m, std::sqrt(2.0));
  EXPECT_EQ(after->along_m, 4);
  EXPECT_DOUBLE_EQ(after->across_m, -std::sqrt(2.0));
  EXPECT_FALSE(field.place({-3, 1}));
  EXPECT_FALSE(field.place({2, 3.001}));
  EXPECT_FALSE(field.place({1e9, 1e9}));
}

}  // namespace
}  // namespace groundray::line_field_test
