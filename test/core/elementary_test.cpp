#include "core/elementary.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace groundray::elementary_test {
namespace {

// Angles of the whole range, and those near the seams between the series.
double fraction(int i) {
  constexpr int count = 1 << 20;
  const double even = static_cast<double>(i) / count;
  const double near_seam = std::round(even * 8) / 8 + (even - 0.5) * 1e-9;
  return std::clamp(i % 2 == 0 ? even : near_seam, 0.0, 1.0);
}
constexpr int fractions = (1 << 20) + 1;

long double turn_rad(double turn) { return 2 * std::numbers::pi_v<long double> * turn; }

// One rounding of the result, and those of the series: 2e-16.
TEST(Elementary, PointsOnTheCircleMatchLongDouble) {
  long double worst = 0;
  for (int i = 0; i < fractions; ++i) {
    const double turn = fraction(i) * 1.125 - 0.125;
    const glm::dvec2 found = on_circle(turn);
    worst = std::max({worst, std::abs(found.x - std::cos(turn_rad(turn))),
                      std::abs(found.y - std::sin(turn_rad(turn)))});
  }
  EXPECT_LT(worst, 2.3e-16L);
}

TEST(Elementary, QuartersOfATurnAreExact) {
  EXPECT_EQ(on_circle(0.0), glm::dvec2(1, 0));
  EXPECT_EQ(on_circle(0.25), glm::dvec2(0, 1));
  EXPECT_EQ(on_circle(0.5), glm::dvec2(-1, 0));
  EXPECT_EQ(on_circle(0.75), glm::dvec2(0, -1));
  EXPECT_EQ(on_circle(1.0), glm::dvec2(1, 0));
}

TEST(Elementary, AnglesMatchLongDouble) {
  long double worst = 0;
  for (int i = 0; i < fractions; ++i) {
    const double cosine = fraction(i);
    worst = std::max(
        worst, std::abs(angle_of_cosine(cosine) - std::acos(static_cast<long double>(cosine))));
  }
  EXPECT_LT(worst, 3e-16L);
}

TEST(Elementary, AnglesOfSineAndCosineMatchLongDouble) {
  long double worst = 0;
  for (int i = 0; i < fractions; ++i) {
    const double part = fraction(i), size = std::ldexp(1.0, i % 200 - 100);
    for (const glm::dvec2 p : {size * glm::dvec2(part, 1), size * glm::dvec2(1, part)}) {
      const auto expected = std::atan2(static_cast<long double>(p.x), p.y);
      if (expected == 0) {
        ASSERT_EQ(angle_of(p.x, p.y), 0);
      } else {
        worst = std::max(worst, std::abs(angle_of(p.x, p.y) / expected - 1));
      }
    }
  }
  EXPECT_LT(worst, 3e-16L);
  EXPECT_TRUE(std::isnan(angle_of(0.0, 0.0)));
  EXPECT_TRUE(all_of(isnan(angle_of(Pack(0.0), Pack(0.0)))));
}

TEST(Elementary, PacksHaveTheBitsOfSingleNumbers) {
  for (int i = 0; i + 4 < fractions; i += 4) {
    const auto number = [&](std::size_t lane) { return fraction(i + static_cast<int>(lane)); };
    const Vec2<Pack> points = on_circle(pack_of(number));
    const Pack angles = angle_of_cosine(pack_of(number));
    const Pack others = angle_of(pack_of(number), 1.0 - pack_of(number));
    for (std::size_t lane = 0; lane < pack_size; ++lane) {
      ASSERT_EQ(glm::dvec2(points.x[lane], points.y[lane]), on_circle(number(lane))) << i;
      ASSERT_EQ(angles[lane], angle_of_cosine(number(lane))) << i;
      ASSERT_EQ(others[lane], angle_of(number(lane), 1.0 - number(lane))) << i;
    }
  }
}

}  // namespace
}  // namespace groundray::elementary_test
