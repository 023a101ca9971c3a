#include "reconstruction/dem/plan_triangle.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <utility>

namespace groundray::plan_triangle_test {
namespace {

GridFrame frame_of(glm::ivec2 samples, glm::dvec2 step_m) {
  return {.samples = samples, .origin_m = {5, 7}, .step_m = step_m, .cells_per_m = 1.0 / step_m};
}

TEST(PlanTriangle, VisitsEachSampleInPlanOnceAtItsHeight) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-20, 40);
  for (int round = 0; round < 400; ++round) {
    const GridFrame frame =
        frame_of({17, 23}, round % 2 == 0 ? glm::dvec2(1, -1) : glm::dvec2(2, 0.5));
    std::array<glm::dvec3, 3> t;
    for (glm::dvec3& p : t) {
      p = {uniform(random), uniform(random), uniform(random)};
      // Some corners on samples, and sides along rows and columns.
      if (round % 3 == 0) p = {frame.to_D(glm::dvec2(random() % 17, random() % 23)), p.z};
    }
    const auto side = [](glm::dvec2 a, glm::dvec2 b, glm::dvec2 q) {
      return (b.x - a.x) * (q.y - a.y) - (b.y - a.y) * (q.x - a.x);
    };
    const double area = side(glm::dvec2(t[0]), glm::dvec2(t[1]), glm::dvec2(t[2]));
    std::set<std::pair<int, int>> found;
    visit_samples(frame, t, [&](int column, int row, double height_m) {
      EXPECT_TRUE(found.emplace(column, row).second);
      const glm::dvec2 q = frame.to_D({column, row});
      double plane_m = 0;
      for (std::size_t k = 0; k < 3; ++k)
        plane_m += t[k].z * side(glm::dvec2(t[(k + 1) % 3]), glm::dvec2(t[(k + 2) % 3]), q) / area;
      EXPECT_NEAR(height_m, plane_m, 1e-9);
    });
    if (area == 0) {
      EXPECT_TRUE(found.empty());
      continue;
    }
    for (int row = 0; row < 23; ++row) {
      for (int column = 0; column < 17; ++column) {
        const glm::dvec2 q = frame.to_D({column, row});
        double least = 1;
        for (std::size_t k = 0; k < 3; ++k)
          least = std::min(least, side(glm::dvec2(t[k]), glm::dvec2(t[(k + 1) % 3]), q) / area);
        if (std::abs(least) < 1e-9 && round % 3 != 0) continue;
        EXPECT_EQ(found.contains({column, row}), least > -1e-9) << column << ' ' << row;
      }
    }
  }
}

// Triangles between neighbouring beams are long and narrow: the bounding box of one of these
// contains 10^10 samples, the triangle some 10^5.
TEST(PlanTriangle, TimeDependsOnCoveredSamplesOnly) {
  const GridFrame frame = frame_of({100'000, 100'000}, {1, 1});
  std::size_t visited = 0;
  for (int k = 0; k < 20; ++k) {
    const double aside = 40.0 * k;
    visit_samples(frame, {{{5, 7, 0}, {90'000 + aside, 90'000, 1}, {90'001.5 + aside, 90'000, 1}}},
                  [&](int, int, double) { ++visited; });
  }
  EXPECT_NEAR(static_cast<double>(visited), 20 * 1.5 * 90'000 / 2, 20'000);
}

}  // namespace
}  // namespace groundray::plan_triangle_test
