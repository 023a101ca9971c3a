#include "terrain/trail/route.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "core/error.h"
#include "terrain/trail/smooth_curve.h"

namespace groundray::route_test {
namespace {

using Ground = std::function<std::optional<double>(glm::dvec2)>;

double length_m(const std::vector<glm::dvec2>& waypoints) {
  return SmoothCurve(waypoints).length_m();
}

TEST(Route, IsStraightOnAPlane) {
  const Ground plane = [](glm::dvec2 p) { return 0.1 * p.x + 0.05 * p.y; };
  const auto route = find_route(plane, {-100, 20}, {150, -80}, {}, {0, 0});
  ASSERT_EQ(route.size(), 2u);
  EXPECT_EQ(route[0], glm::dvec2(-100, 20));
  EXPECT_EQ(route[1], glm::dvec2(150, -80));
}

// On a plane of slope 0.4, a route of grade g straight uphill is longer by 0.4 / g: it winds.
TEST(Route, WindsUpASlopeThatIsTooSteep) {
  const Ground slope = [](glm::dvec2 p) { return 0.4 * p.y; };
  const RouteLimits limits{.most_grade = 0.25, .most_side_slope = 1};
  const auto route = find_route(slope, {0, 0}, {0, 100}, limits, {0, 0});
  EXPECT_GE(length_m(route), 100 * 0.4 / 0.25);
  for (std::size_t i = 1; i < route.size(); ++i) {
    const double grade =
        0.4 * (route[i].y - route[i - 1].y) / glm::distance(route[i], route[i - 1]);
    EXPECT_LE(std::abs(grade), 0.25) << i;
  }
}

// The shortest way round a round hill of radius r between points at distance d on both sides of it
// consists of two tangents and an arc. Lattice paths of 16 directions are at most 2.8 % longer.
TEST(Route, GoesRoundAHill) {
  const Ground hill = [](glm::dvec2 p) { return glm::length(p) < 30 ? 100.0 : 0.0; };
  const auto route = find_route(hill, {-60, 0}, {60, 0}, {}, {0, 0});
  const double shortest_m =
      2 * std::sqrt(60.0 * 60 - 30 * 30) + 30 * (3.14159265 - 2 * std::acos(30.0 / 60));
  for (const glm::dvec2 p : route) EXPECT_GT(glm::length(p), 30);
  EXPECT_GT(length_m(route), shortest_m);
  EXPECT_LT(length_m(route), 1.06 * shortest_m);
}

TEST(Route, ErrorNamesTheNearestPlaceInW) {
  const Ground trench = [](glm::dvec2 p) -> std::optional<double> {
    if (std::abs(p.x - 40) < 5) return std::nullopt;
    return 0.0;
  };
  EXPECT_THAT(
      [&] {
        find_route(trench, {0, 0}, {100, 0}, {}, {5000, 7000});
      },
      ::testing::ThrowsMessage<Error>(::testing::AllOf(
          ::testing::HasSubstr("there is no way to (5100.0, 7000.0) m in W with grades of at "
                               "most 25.2 degrees"),
          ::testing::HasSubstr("leads no nearer than (5035.0, 7000.0) m"))));
}

}  // namespace
}  // namespace groundray::route_test
