#include <gtest/gtest.h>

#include <cmath>

#include "reconstruction/mesh/simplify/edge_collapse.h"

namespace groundray::cost_knee_test {
namespace {

// A cost that grows as one power of 1 / triangles and then as a larger one has its knee where the
// power changes: the curve is two straight lines in logarithms.
TEST(CostKnee, IsWhereTheExponentChanges) {
  std::vector<CostStep> steps{{0, 10001}};
  for (std::size_t triangles = 10000; triangles > 10; --triangles) {
    const double share = 500.0 / static_cast<double>(triangles);
    steps.push_back({share < 1 ? std::pow(share, 0.5) : std::pow(share, 4), triangles});
  }
  EXPECT_EQ(find_knee(steps), 500u);
  // Steps of zero cost, and cheap steps after expensive ones, change nothing.
  steps.insert(steps.begin(), {0, 12000});
  steps.insert(steps.begin() + 9000, {1e-3, steps[8999].triangles});
  EXPECT_EQ(find_knee(steps), 500u);
}

TEST(CostKnee, IsTheEndForZeroCost) {
  EXPECT_EQ(find_knee({{0, 9}, {0, 7}, {0, 5}}), 5u);
  EXPECT_EQ(find_knee({{0, 1}}), 1u);
}

// Only the range from half of the triangles to a thousandth counts, whatever is before and after.
TEST(CostKnee, IgnoresTheFirstAndLastTriangles) {
  std::vector<CostStep> steps{{0, 10000}};
  for (std::size_t triangles = 9999; triangles > 2; --triangles) {
    const double share = 300.0 / static_cast<double>(triangles);
    const double cost = share < 1 ? std::pow(share, 3) : std::pow(share, 0.7);
    const bool is_amid = triangles <= 5000 && triangles >= 10;
    steps.push_back({is_amid ? cost : (triangles > 5000 ? 1e-30 : 1e30), triangles});
  }
  EXPECT_EQ(find_knee(steps), 300u);
}

}  // namespace
}  // namespace groundray::cost_knee_test
