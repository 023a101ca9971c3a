#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "apps/view/window/orbit.h"

namespace groundray::window_orbit_test {
namespace {

constexpr double tolerance_m = 1e-6;  // coordinates of 5e6 m have a resolution of 1e-9 m
const Look from_south{
    .from_w_m = {430000, 5150000 - 100, 300}, .at_w_m = {430000, 5150000, 300}, .up = {0, 0, 1}};

void expect_near(const glm::dvec3& a, const glm::dvec3& b) {
  EXPECT_LT(glm::distance(a, b), tolerance_m)
      << a.x << ' ' << a.y << ' ' << a.z << " against " << b.x << ' ' << b.y << ' ' << b.z;
}

TEST(Orbit, TurnsAboutTheFocalPoint) {
  constexpr double quarter_rad = std::numbers::pi / 2;
  // A quarter turn, counter-clockwise from above, moves the eye from the south to the east.
  expect_near(orbited(from_south, quarter_rad, 0).from_w_m,
              from_south.at_w_m + glm::dvec3(100, 0, 0));
  expect_near(orbited(from_south, 0, quarter_rad / 3).from_w_m,
              from_south.at_w_m + 100.0 * glm::dvec3(0, -std::cos(quarter_rad / 3), 0.5));
  Look look = from_south;
  for (int i = 0; i < 360; ++i) look = orbited(look, std::numbers::pi / 180, 0);
  expect_near(look.from_w_m, from_south.from_w_m);
}

TEST(Orbit, StopsBeforeThePoles) {
  for (const double pitch_rad : {10.0, -10.0}) {
    const Look look = orbited(from_south, 0.3, pitch_rad);
    EXPECT_NEAR(glm::distance(look.from_w_m, look.at_w_m), 100, tolerance_m);
    const glm::dvec3 ahead = glm::normalize(look.at_w_m - look.from_w_m);
    EXPECT_GT(std::hypot(ahead.x, ahead.y), 1e-4);  // not vertical, so up is defined
    EXPECT_EQ(look.up, glm::dvec3(0, 0, 1));
  }
}

TEST(Orbit, KeepsThePictureUprightFromStraightAbove) {
  const Look above{.from_w_m = {0, 0, 50}, .at_w_m = {0, 0, 0}, .up = {0, 1, 0}};
  const Look tilted = orbited(above, 0, -0.5);
  EXPECT_LT(tilted.from_w_m.y, -1);  // north was up, so the eye moves south
  EXPECT_NEAR(tilted.from_w_m.x, 0, tolerance_m);
}

TEST(Orbit, MovesParallelToThePicture) {
  const Look moved = panned(from_south, 3, 4);
  expect_near(moved.from_w_m, from_south.from_w_m + glm::dvec3(3, 0, 4));
  expect_near(moved.at_w_m, from_south.at_w_m + glm::dvec3(3, 0, 4));
  const Look flown_there = flown(from_south, {1, 2, 3});
  expect_near(flown_there.from_w_m, from_south.from_w_m + glm::dvec3(2, 1, 3));
}

TEST(Orbit, ZoomsTowardsThePointer) {
  const glm::dvec3 towards = from_south.at_w_m + glm::dvec3(20, 0, 10);
  const Look near = zoomed(from_south, 0.5, towards);
  EXPECT_NEAR(glm::distance(near.from_w_m, near.at_w_m), 50, tolerance_m);
  // The target keeps its position in the picture: the same direction from the eye.
  expect_near(glm::normalize(towards - near.from_w_m),
              glm::normalize(towards - from_south.from_w_m));
}

TEST(Orbit, ComputesTheWidthOfAPixel) {
  // At a distance of 100 m, 90 degrees cover a height of 200 m.
  EXPECT_NEAR(metres_per_pixel(from_south, std::numbers::pi / 2, 400), 0.5, 1e-12);
}

}  // namespace
}  // namespace groundray::window_orbit_test
