#include "terrain/assets/fence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "core/error.h"

namespace groundray::fence_test {
namespace {

using ::testing::HasSubstr;

constexpr double inch = 0.0254;

TEST(FencePosts, StandAtCornersAndInEqualBays) {
  const std::vector<glm::dvec2> line = {{0, 0}, {10, 0}, {10, 4.2}, {13, 8.2}};
  const std::vector<glm::dvec2> posts =
      fence_posts({.kind = AssetKind::Fence, .width_m = 2.5}, line);
  // 10 m in four bays of 2.5 m, 4.2 m in two, 5 m in two.
  const std::vector<glm::dvec2> expected = {{0, 0},    {2.5, 0},  {5, 0},      {7.5, 0}, {10, 0},
                                            {10, 2.1}, {10, 4.2}, {11.5, 6.2}, {13, 8.2}};
  ASSERT_EQ(posts.size(), expected.size());
  for (std::size_t i = 0; i < posts.size(); ++i)
    EXPECT_LT(glm::distance(posts[i], expected[i]), 1e-12);
  // By default at most 14 feet: 25.6 m, 84 feet, are six bays.
  EXPECT_EQ(
      fence_posts({.kind = AssetKind::Fence}, std::vector<glm::dvec2>{{0, 0}, {0, 25.6}}).size(),
      7u);
}

// Posts of 6 feet, 24 inches of them in the ground, and wires up to 42 inches above it, wherever
// the ground is: NRCS Kentucky, code 382 (2007). Posts vary in height by 20 mm (one standard
// deviation).
TEST(Fence, FollowsItsPosts) {
  std::vector<glm::dvec3> posts;
  for (int i = 0; i < 12; ++i) posts.emplace_back(3.5 * i, 0.3 * i * i, std::sin(i) * 1.3);
  const Model model = make_fence({.kind = AssetKind::Fence, .seed = {2}}, posts);
  std::vector<double> low(posts.size(), 1e9), high(posts.size(), -1e9);
  std::vector<int> wires(posts.size(), 0);
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    const bool is_wire = model.surfaces[model.surface_of[i]].name == "metal";
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& p = model.mesh.vertices_m[model.mesh.triangles[i][k]];
      std::size_t post = 0;
      for (std::size_t j = 1; j < posts.size(); ++j) {
        if (glm::distance(glm::dvec2(p), glm::dvec2(posts[j])) <
            glm::distance(glm::dvec2(p), glm::dvec2(posts[post])))
          post = j;
      }
      EXPECT_LT(glm::distance(glm::dvec2(p), glm::dvec2(posts[post])), 0.2);
      const double above = p.z - posts[post].z;
      if (!is_wire) {
        low[post] = std::min(low[post], above);
        high[post] = std::max(high[post], above);
        continue;
      }
      const double number = std::round(above / (42 * inch / 5));
      EXPECT_TRUE(1 <= number && number <= 5);
      EXPECT_NEAR(above, number * 42 * inch / 5, 0.0026);  // the wire's radius
      ++wires[post];
    }
  }
  for (std::size_t i = 0; i < posts.size(); ++i) {
    EXPECT_NEAR(low[i], -24 * inch, 0.005);
    EXPECT_NEAR(high[i], 48 * inch + (i == 0 || i + 1 == posts.size() ? 0.08 : 0), 0.08);
    EXPECT_GT(wires[i], 0);
  }
}

std::string fault_of(const std::vector<glm::dvec2>& line, double bay_m) {
  try {
    fence_posts({.kind = AssetKind::Fence, .width_m = bay_m}, line);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(FencePosts, RejectsLinesThatAreNone) {
  EXPECT_THAT(fault_of({{1, 1}}, 3), HasSubstr("at least two points, but has 1"));
  EXPECT_THAT(fault_of({{1, 1}, {2, 1}, {2, 1}}, 3),
              HasSubstr("points 2 and 3 of the fence's line"));
  EXPECT_THAT(fault_of({{0, 0}, {20, 0}, {0, 0.1}}, 3),
              HasSubstr("the fence's line turns back at point 2"));
  EXPECT_THAT(fault_of({{0, 0}, {1e6, 0}}, 3), HasSubstr("more than 10000 posts"));
}

}  // namespace
}  // namespace groundray::fence_test
