#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <glm/geometric.hpp>
#include <random>

#include "reconstruction/mesh/merge/open_border.h"

namespace groundray::point_tree_test {
namespace {

using ::testing::IsEmpty;
using ::testing::UnorderedElementsAreArray;

TEST(PointTree, MatchesBruteForce) {
  std::mt19937_64 random(4);
  std::uniform_int_distribution<int> step(-9, 9);  // many points share coordinates, some all three
  for (const std::size_t count : {0, 1, 2, 3, 7, 64, 1000}) {
    std::vector<glm::dvec3> points_m;
    for (std::size_t i = 0; i < count; ++i)
      points_m.emplace_back(0.5 * step(random), step(random), 0.1 * step(random));
    const PointTree tree(points_m);
    for (int i = 0; i < 60; ++i) {
      const glm::dvec3 place_m(0.5 * step(random), step(random), 0.1 * step(random));
      const double within_m = 0.25 * (i % 20);
      std::vector<std::uint32_t> expected;
      for (std::uint32_t k = 0; k < count; ++k) {
        if (glm::distance(points_m[k], place_m) <= within_m) expected.push_back(k);
      }
      EXPECT_THAT(tree.near(place_m, within_m), UnorderedElementsAreArray(expected));
    }
  }
}

TEST(PointTree, FindsNothingFarAway) {
  EXPECT_THAT(PointTree({{1, 2, 3}, {4, 5, 6}}).near({100, 0, 0}, 5), IsEmpty());
}

}  // namespace
}  // namespace groundray::point_tree_test
