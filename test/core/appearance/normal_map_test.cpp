#include "core/appearance/normal_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace groundray::normal_map_test {
namespace {

// A chain of some twenty operations on numbers of order 1, each with a rounding error of 1e-16.
constexpr double tolerance = 1e-13;

glm::dvec3 vector(std::uint32_t i, std::uint32_t k) {
  const glm::dvec2 xy = random_uniform({Seed{31}, 0, i, 2 * k});
  const glm::dvec2 z = random_uniform({Seed{31}, 0, i, 2 * k + 1});
  return 2.0 * glm::dvec3(xy, z.x) - 1.0;
}

TEST(NormalMap, DecodesAsInGltf) {
  EXPECT_EQ(decode_normal({0.5f, 0.5f, 1}), glm::dvec3(0, 0, 1));
  EXPECT_EQ(decode_normal({1, 0.75f, 0.5f}), glm::dvec3(1, 0.5, 0));
}

TEST(ShadingNormal, OfAFlatNormalMapIsTheBase) {
  const Tangents tangents{{2, 0, 0.3}, {0.5, 3, 0}};
  const glm::dvec3 base = glm::normalize(glm::dvec3(0.1, 0.2, 1));
  const glm::dvec3 normal = shading_normal(tangents, base, {0, 0, 1}, {0, 0, 0.7});
  EXPECT_NEAR(glm::length(normal - base), 0, tolerance);
}

// A plane with heights is itself a surface, whose normal is the cross product of its derivatives.
// Includes mirrored images.
TEST(ShadingNormal, MatchesTheReliefOfTheMap) {
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const glm::dvec3 n = glm::normalize(vector(i, 0));
    const glm::dvec3 x = glm::normalize(glm::cross(n, vector(i, 1)));
    const glm::dvec3 y = (i % 2 == 0 ? 1.0 : -1.0) * glm::cross(n, x);
    const Tangents tangents{3.0 * x, 0.5 * y};
    const glm::dvec3 slopes = 2.0 * vector(i, 2);  // m/m along u and v
    const glm::dvec3 along_u = tangents.dp_du + 3.0 * slopes.x * n;
    const glm::dvec3 along_v = tangents.dp_dv + 0.5 * slopes.y * n;
    glm::dvec3 expected = glm::normalize(glm::cross(along_u, along_v));
    if (glm::dot(expected, n) < 0) expected = -expected;
    const glm::dvec3 bump(-slopes.x, -slopes.y, 1);
    const glm::dvec3 normal = shading_normal(tangents, n, n, bump);
    EXPECT_NEAR(glm::length(normal - expected), 0, tolerance);
  }
}

TEST(ShadingNormal, HasUnitLengthAndIsNeverBelowTheHorizon) {
  for (std::uint32_t i = 0; i < 10'000; ++i) {
    const Tangents tangents{vector(i, 0), i % 10 == 0 ? glm::dvec3(0) : vector(i, 1)};
    const glm::dvec3 geometric = glm::normalize(vector(i, 2));
    const glm::dvec3 base = i % 7 == 0 ? -geometric : glm::normalize(vector(i, 3));
    const glm::dvec3 bump = i % 5 == 0 ? glm::dvec3(0, 0, -1) : vector(i, 4);
    const glm::dvec3 normal = shading_normal(tangents, base, geometric, bump);
    EXPECT_NEAR(glm::length(normal), 1, tolerance);
    EXPECT_GE(glm::dot(normal, geometric), least_shading_cosine);
  }
}

// Lifting rotates a normal in the plane spanned with the geometric normal, and no farther than
// needed.
TEST(ShadingNormal, IsClampedToTheHorizon) {
  const glm::dvec3 up(0, 0, 1), low = glm::normalize(glm::dvec3(3, 4, -2));
  const glm::dvec3 normal = shading_normal({}, low, up, {0, 0, 1});
  EXPECT_NEAR(normal.z, least_shading_cosine, 1e-8);
  EXPECT_NEAR(normal.x * 4, normal.y * 3, tolerance);
  EXPECT_GT(normal.x, 0);
}

TEST(ShadingNormal, WithoutTangentsIsTheBase) {
  const glm::dvec3 base = glm::normalize(glm::dvec3(1, 2, 3));
  EXPECT_EQ(shading_normal({}, base, base, {0.5, 0.5, 0.5}), base);
}

}  // namespace
}  // namespace groundray::normal_map_test
