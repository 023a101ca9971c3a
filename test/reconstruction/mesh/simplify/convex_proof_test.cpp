#include "reconstruction/mesh/simplify/convex_proof.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "core/tracing/closest_point.h"

namespace groundray::convex_proof_test {
namespace {

using Triangle = std::array<glm::dvec3, 3>;

/// Triangles that all permit the same distance.
struct Others {
  std::vector<Triangle> triangles;
  double most_m = 0;
  std::set<std::uint32_t> used{};

  double distance_m(const glm::dvec3& p, std::uint32_t i) const {
    return glm::length(vector_to_triangle(p, triangles[i][0], triangles[i][1], triangles[i][2]));
  }
  double excess_m(const ProofCorner& corner, std::uint32_t i) const {
    return distance_m(corner.p_m, i) - most_m;
  }
  ProofCorner at(const glm::dvec3& p) const {
    ProofCorner corner{.p_m = p, .excess_m = std::numeric_limits<double>::infinity()};
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      if (distance_m(p, i) - most_m >= corner.excess_m) continue;
      corner.excess_m = distance_m(p, i) - most_m;
      corner.nearest = i;
    }
    return corner;
  }
  ProofCorner corner(const ProofCorner& a, const ProofCorner& b, double share) const {
    return at((1 - share) * a.p_m + share * b.p_m);
  }
  void use(std::uint32_t i) { used.insert(i); }
};

bool is_proved(const Triangle& triangle, Others& others, std::size_t most_parts = 200) {
  others.used.clear();
  return ConvexProof<Others>().holds(
      {others.at(triangle[0]), others.at(triangle[1]), others.at(triangle[2])}, most_parts, others);
}

// Largest distance of dense samples from all the triangles that the proof uses.
double farthest_m(const Triangle& triangle, const Others& others) {
  double farthest = 0;
  constexpr int steps = 40;
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; i + j <= steps; ++j) {
      const double a = i / double{steps}, b = j / double{steps};
      const glm::dvec3 p = a * triangle[0] + b * triangle[1] + (1 - a - b) * triangle[2];
      double nearest = std::numeric_limits<double>::infinity();
      for (const std::uint32_t k : others.used)
        nearest = std::min(nearest, others.distance_m(p, k));
      farthest = std::max(farthest, nearest);
    }
  }
  return farthest;
}

TEST(ConvexProof, ProvesATriangleThatSeveralTrianglesCover) {
  Others fan{.most_m = 1e-9};
  for (int i = 0; i < 6; ++i) {
    const double from = i * 1.0471975511965976, to = from + 1.0471975511965976;
    fan.triangles.push_back({glm::dvec3(0),
                             {4 * std::cos(from), 4 * std::sin(from), 0},
                             {4 * std::cos(to), 4 * std::sin(to), 0}});
  }
  const Triangle across{{{-2, 0.3, 0}, {1.7, 1.1, 0}, {0.2, 2.5, 0}}};
  EXPECT_TRUE(is_proved(across, fan));
  EXPECT_GE(fan.used.size(), 3u);
  const Triangle beyond{{{-2, 0.3, 0}, {1.7, 1.1, 0}, {0.2, 4.5, 0}}};
  EXPECT_FALSE(is_proved(beyond, fan));
}

// All corners are near, but the centre is not.
TEST(ConvexProof, FailsOverAGap) {
  Others apart{
      .triangles = {{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, {{{9, 0, 0}, {8, 0, 0}, {9, 1, 0}}}},
      .most_m = 0.5};
  EXPECT_FALSE(is_proved({{{0, 0, 0}, {9, 0, 0}, {0, 0.5, 0}}}, apart, 100'000));
}

TEST(ConvexProof, NeverProvesATriangleThatIsTooFar) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-1, 1);
  const auto any = [&] {
    const double x = place(random), y = place(random);
    return glm::dvec3(x, y, 0.3 * place(random));
  };
  int proved = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    Others others{.most_m = 0.2 + 0.3 * std::abs(place(random))};
    for (int i = 0; i < 5; ++i) {
      const glm::dvec3 a = any(), b = any();
      others.triangles.push_back({a, b, any()});
    }
    const glm::dvec3 a = 0.5 * any(), b = 0.5 * any();
    const Triangle triangle{a, b, 0.5 * any()};
    if (!is_proved(triangle, others)) continue;
    ++proved;
    EXPECT_LE(farthest_m(triangle, others), others.most_m * (1 + 1e-12)) << "trial " << trial;
  }
  EXPECT_GT(proved, 200);
}

}  // namespace
}  // namespace groundray::convex_proof_test
