#include "terrain/assets/fracture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <vector>

namespace groundray::fracture_test {
namespace {

AssetRandom random_of(std::uint64_t seed) { return {AssetKind::Boulder, Seed{seed}}; }

// Three sets that are not at right angles.
const RockMass oblique{.sets = {{{glm::normalize(glm::dvec3(0.1, 0.2, 1)), 0.6},
                                 {glm::normalize(glm::dvec3(1, 0.3, 0)), 1},
                                 {glm::normalize(glm::dvec3(-0.2, 1, 0.1)), 0.8}}}};

// Kolmogorov-Smirnov test against F(x) = (exp(-a) - exp(-x)) / (exp(-a) - exp(-b)). One test for
// each set, at a significance of 1 % in all: 0.33 % each (Sidak), K = 1.79.
TEST(RockBlock, SpacingsAreTruncatedExponential) {
  constexpr std::size_t count = 4000;
  std::array<std::vector<double>, 3> spacings;
  for (std::uint64_t seed = 0; seed < count; ++seed) {
    AssetRandom random = random_of(seed);
    const std::vector<RockPlane> planes = rock_block(oblique, random);
    ASSERT_EQ(planes.size(), 6u);
    for (std::size_t set = 0; set < 3; ++set) {
      EXPECT_EQ(planes[2 * set].normal, -planes[2 * set + 1].normal);
      spacings[set].push_back((planes[2 * set].offset + planes[2 * set + 1].offset) /
                              oblique.sets[set].spacing);
    }
  }
  const double from = std::exp(-least_spacing), to = std::exp(-most_spacing);
  for (std::vector<double>& sorted : spacings) {
    std::ranges::sort(sorted);
    double most = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double share = (from - std::exp(-sorted[i])) / (from - to);
      most = std::max(
          {most, std::abs(share - double(i) / count), std::abs(share - double(i + 1) / count)});
    }
    EXPECT_LT(most * std::sqrt(double(count)), 1.79);
    EXPECT_GE(sorted.front(), least_spacing * (1 - 1e-12));
    EXPECT_LE(sorted.back(), most_spacing * (1 + 1e-12));
  }
}

// The volume between three pairs of parallel planes is the product of their distances over the
// triple product of their normals; the corners' box in the joints' own coordinates gives it, too.
TEST(RockBlock, IsAParallelepipedWithoutScatterAndChips) {
  AssetRandom random = random_of(5);
  const std::vector<RockPlane> planes = rock_block(oblique, random);
  const std::vector<glm::dvec3> corners = corners_of(planes);
  ASSERT_EQ(corners.size(), 8u);
  for (const glm::dvec3& p : corners) {
    for (const JointSet& set : oblique.sets) {
      const auto k = static_cast<std::size_t>(&set - oblique.sets.data());
      EXPECT_NEAR(std::abs(glm::dot(set.normal, p)), planes[2 * k].offset, 1e-12);
    }
  }
}

TEST(RockBlock, IsConvexAndBounded) {
  RockMass mass = oblique;
  mass.scatter_rad = 0.08;
  mass.chips = 14;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    AssetRandom random = random_of(seed);
    const std::vector<RockPlane> planes = rock_block(mass, random);
    const std::vector<glm::dvec3> corners = corners_of(planes);
    ASSERT_EQ(planes.size(), 20u);
    ASSERT_GE(corners.size(), 8u);
    for (const glm::dvec3& p : corners) {
      EXPECT_LT(glm::length(p), 4);
      int touched = 0;
      for (const RockPlane& plane : planes) {
        const double ahead = glm::dot(plane.normal, p) - plane.offset;
        EXPECT_LE(ahead, 1e-8);
        touched += ahead > -1e-8 ? 1 : 0;
      }
      EXPECT_GE(touched, 3);
    }
    for (const RockPlane& plane : planes) EXPECT_GT(plane.offset, 0);  // contains its middle
  }
}

// A cube with edges of radius r: its edges recede by (sqrt(2) - 1) r along the diagonal, its faces
// stay. The soft maximum differs by the third face's share, exp(-1 / width).
TEST(RockBlock, EdgesRecedeAsRoundedOnes) {
  std::vector<RockPlane> cube;
  for (int k = 0; k < 3; ++k) {
    for (const double side : {-1.0, 1.0}) {
      glm::dvec3 normal(0);
      normal[k] = side;
      cube.push_back({normal, 1});
    }
  }
  const double edge = 0.1, recedes = (std::sqrt(2.0) - 1) * edge;
  const double along = 1 - recedes / std::sqrt(2.0);
  EXPECT_NEAR(rounded_level(cube, edge, {along, along, 0}), 0, 1e-9);
  EXPECT_NEAR(rounded_level(cube, edge, {0, 1, 0}), 0, 1e-9);
  EXPECT_NEAR(rounded_level(cube, edge, {0, 0, 0.5}), -0.5, 1e-4);
  // Weathering takes away, never adds.
  AssetRandom random = random_of(1);
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 p = 1.2 * random.direction();
    const double farthest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) - 1;
    EXPECT_GE(rounded_level(cube, edge, p), farthest);
  }
}

}  // namespace
}  // namespace groundray::fracture_test
