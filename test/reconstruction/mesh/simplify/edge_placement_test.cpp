#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <vector>

#include "reconstruction/mesh/simplify/volume_collapse.h"

namespace groundray::edge_placement_test {
namespace {

using Triangle = std::array<glm::dvec3, 3>;

/// Triangles at the ends of an edge, and the border's edges there, relative to the first end.
struct Patch {
  std::vector<Triangle> triangles;  // of both ends, each once
  EdgeSurroundings edge;

  Patch(const std::vector<Triangle>& first, const std::vector<Triangle>& second,
        const std::vector<Triangle>& both, const glm::dvec3& end) {
    edge.edge_m = end;
    VolumeTerm of_second;
    const auto normal = [](const Triangle& t) { return glm::cross(t[1] - t[0], t[2] - t[0]); };
    for (const auto* some : {&first, &second, &both}) {
      for (const Triangle& t : *some) {
        triangles.push_back(t);
        edge.volume.add(normal(t));
        if (some != &first) of_second.add(normal(t));
      }
    }
    // Both ends' sums contain the triangles at the edge, so these are subtracted once.
    edge.pull = of_second.times(end);
    edge.lift = glm::dot(of_second.normal, end);
    edge.rest = glm::dot(end, edge.pull);
  }

  double signed_volume_m3(const glm::dvec3& p) const {
    double sum = 0;
    for (const Triangle& t : triangles)
      sum += glm::dot(p - t[0], glm::cross(t[1] - t[0], t[2] - t[0])) / 6;
    return sum;
  }
  double cost(const glm::dvec3& p) const {  // Lindstrom and Turk (1998), with both weights a half
    double volume = 0, area = 0;
    for (const Triangle& t : triangles) {
      const double v = glm::dot(p - t[0], glm::cross(t[1] - t[0], t[2] - t[0])) / 6;
      volume += v * v;
    }
    for (const auto& [begin, end] : edge.borders) {
      const double twice = glm::length(glm::cross(begin - p, end - p));
      area += twice * twice / 4;
    }
    return volume / 2 + glm::dot(edge.edge_m, edge.edge_m) * area / 2;
  }
};

// An edge inside about six rough triangles.
Patch rough_patch(std::mt19937_64& random) {
  std::uniform_real_distribution<double> rough(-0.4, 0.4);
  const auto near = [&](double x, double y) {
    const double dx = rough(random), dy = rough(random);
    return glm::dvec3(x + dx, y + dy, rough(random));
  };
  const glm::dvec3 a(0), b = near(1, 0), north = near(0.5, 1), south = near(0.5, -1),
                         west = near(-1, 0.2), east = near(2, -0.1);
  return {{{a, north, west}, {a, west, south}},
          {{b, south, east}, {b, east, north}},
          {{a, b, north}, {b, a, south}},
          b};
}

TEST(EdgePlacement, MinimisesTheCostAtConstantVolume) {
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 200; ++trial) {
    const Patch patch = rough_patch(random);
    const auto found = place_edge(patch.edge);
    ASSERT_TRUE(found);
    EXPECT_NEAR(patch.signed_volume_m3(found->place_m), 0, 1e-12);
    EXPECT_NEAR(found->cost, patch.cost(found->place_m), 1e-12);
    const glm::dvec3 normal = patch.edge.volume.normal;
    for (const glm::dvec3& way : {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(1, 1, 1)}) {
      const glm::dvec3 along = 1e-2 * glm::normalize(glm::cross(normal, way));
      for (const double sign : {-1., 1.})
        EXPECT_GE(patch.cost(found->place_m + sign * along), found->cost * (1 - 1e-9));
    }
  }
}

// A flat patch leaves the position free within its plane: it is the mean of the surrounding
// vertices.
TEST(EdgePlacement, UsesTheMeanOfTheNeighboursInAPlane) {
  const glm::dvec3 a(0), b(1, 0, 0), north(0.5, 1, 0), south(0.5, -1, 0), west(-1, 0, 0),
      east(3, 0, 0);
  Patch patch({{a, north, west}, {a, west, south}}, {{b, south, east}, {b, east, north}},
              {{a, b, north}, {b, a, south}}, b);
  EXPECT_FALSE(place_edge(patch.edge));
  patch.edge.middle_m = glm::dvec3(0.75, 0.1, 7);
  const auto found = place_edge(patch.edge);
  ASSERT_TRUE(found);
  EXPECT_LT(glm::distance(found->place_m, {0.75, 0.1, 0}), 1e-14);
  EXPECT_EQ(found->cost, 0);
}

// Also along a straight border through the first end.
TEST(EdgePlacement, StaysOnAStraightBorder) {
  const glm::dvec3 a(0), b(1, 0, 0.2), inner(0.5, 1, 0.4), west(-1, 0, 0.1), east(2, 0, -0.3),
      north_west(-0.7, 1, 0), north_east(1.8, 1, 0.1);
  Patch patch({{a, inner, north_west}, {a, north_west, west}},
              {{b, east, north_east}, {b, north_east, inner}}, {{a, b, inner}}, b);
  const std::array<EdgeSurroundings::BorderEdge, 3> borders{{{west, a}, {a, b}, {b, east}}};
  patch.edge.borders = borders;
  const auto found = place_edge(patch.edge);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->cost, patch.cost(found->place_m), 1e-12);
  // The border stays in the vertical plane y = 0 and keeps its area there.
  EXPECT_NEAR(found->place_m.y, 0, 1e-12);
  double twice_m2 = 0;
  for (const auto& [begin, end] : borders)
    twice_m2 += glm::cross(begin - found->place_m, end - found->place_m).y;
  EXPECT_NEAR(twice_m2, 0, 1e-12);
}

}  // namespace
}  // namespace groundray::edge_placement_test
