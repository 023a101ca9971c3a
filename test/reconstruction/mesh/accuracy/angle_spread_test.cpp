#include "reconstruction/mesh/accuracy/angle_spread.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "reconstruction/mesh/accuracy/accuracy.h"

namespace groundray::angle_spread_test {
namespace {

constexpr double resolution = 0.011;  // of percentiles

glm::dvec3 turned(double angle_rad) { return {std::sin(angle_rad), 0, 3 * std::cos(angle_rad)}; }

TEST(AngleSpread, EvenlyDistributedAnglesHaveTheirPercentiles) {
  AngleSpread all;
  const int count = 10'000;
  for (int i = 0; i < count; ++i) {
    const double angle = std::numbers::pi * (i + 0.5) / count;
    const glm::dvec3 direction(0.2 * std::sin(angle), 0, 0.2 * std::cos(angle));
    AngleSpread one;
    one.add({0, 0, 7}, direction, 0.5);
    all.add(one);
  }
  EXPECT_NEAR(all.mean_rad(), std::numbers::pi / 2, 1e-9);
  EXPECT_NEAR(all.rms_rad(), std::numbers::pi / std::sqrt(3), 1e-8);
  EXPECT_NEAR(all.largest_rad(), std::numbers::pi * (1 - 0.5 / count), 1e-12);
  EXPECT_NEAR(all.area_m2(), 0.5 * count, 1e-6);
  EXPECT_EQ(all.samples(), std::size_t{count});
  for (const double share : {0.01, 0.1, 0.5, 0.9, 0.99})
    EXPECT_NEAR(all.percentile_rad(share) / (std::numbers::pi * share), 1, resolution) << share;
  EXPECT_EQ(all.percentile_rad(1), all.largest_rad());
}

TEST(AngleSpread, CountsAreaWithoutADirectionSeparately) {
  AngleSpread spread;
  spread.add({0, 0, 1}, {0, 0, 0}, 2);
  EXPECT_EQ(spread.unknown_m2(), 2);
  EXPECT_EQ(spread.mean_rad(), 0);
  EXPECT_EQ(spread.percentile_rad(0.5), 0);
  spread.add({0, 0, 1}, turned(0), 3);
  EXPECT_EQ(spread.area_m2(), 3);
  EXPECT_EQ(spread.largest_rad(), 0);
  EXPECT_EQ(spread.samples(), 2u);
  EXPECT_THROW(static_cast<void>(spread.percentile_rad(1.1)), Error);
  EXPECT_THROW(static_cast<void>(spread.percentile_rad(std::nan(""))), Error);
}

// Three squares over a plane, turned about y by the angles.
TEST(AngleSpread, WeightsAnglesByArea) {
  const std::vector<double> angles_rad{0.001, 0.2, 2.8};
  const std::vector<double> lengths_m{5, 4, 1};
  TriangleMesh squares;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto first = static_cast<unsigned>(squares.vertices_m.size());
    const glm::dvec3 at(10.0 * static_cast<double>(i), 0, 1);
    const glm::dvec3 along(lengths_m[i] * std::cos(angles_rad[i]), 0,
                           -lengths_m[i] * std::sin(angles_rad[i]));
    const glm::dvec3 side(0, 1, 0);
    squares.vertices_m.insert(squares.vertices_m.end(),
                              {at, at + along, at + along + side, at + side});
    squares.triangles.insert(squares.triangles.end(),
                             {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
  }
  const TriangleMesh plane{
      {{-99, -99, 0}, {99, -99, 0}, {99, 99, 0}, {-99, 99, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
  const AngleSpread turn = MeshDistance(squares, plane).mean(0.1).turn;
  EXPECT_NEAR(turn.mean_rad(), (5 * 0.001 + 4 * 0.2 + 2.8) / 10, 1e-9);
  EXPECT_NEAR(turn.rms_rad(), std::sqrt((5 * 1e-6 + 4 * 0.04 + 2.8 * 2.8) / 10), 1e-9);
  EXPECT_NEAR(turn.largest_rad(), 2.8, 1e-9);
  EXPECT_NEAR(turn.percentile_rad(0.4) / 0.001, 1, resolution);
  EXPECT_NEAR(turn.percentile_rad(0.7) / 0.2, 1, resolution);
  EXPECT_NEAR(turn.percentile_rad(0.95) / 2.8, 1, resolution);
  EXPECT_NEAR(turn.area_m2(), 10, 1e-9);
  EXPECT_EQ(turn.unknown_m2(), 0);
  // In the reverse direction all of the plane is nearest to some square; half of it is hardly
  // turned.
  EXPECT_GT(MeshDistance(plane, squares).mean(1).turn.percentile_rad(0.9), 0.2 * (1 - resolution));
}

}  // namespace
}  // namespace groundray::angle_spread_test
