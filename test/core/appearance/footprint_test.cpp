#include "core/geometry/footprint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace groundray::footprint_test {
namespace {

// For values between 1 and 10 after some ten operations, including divisions by areas and cosines
// of at least 0.1.
constexpr double tolerance = 1e-11;

double number(std::uint32_t i, std::uint32_t k) {
  return 2 * random_uniform({Seed{21}, 0, i, k}).x - 1;
}

glm::dvec3 vector(std::uint32_t i, std::uint32_t k) {
  return {number(i, 3 * k), number(i, 3 * k + 1), number(i, 3 * k + 2)};
}

// The corners of a square perpendicular to the ray, projected along it onto the plane.
TEST(SurfacePatch, ProjectsToASquareAcrossTheRay) {
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const glm::dvec3 d = glm::normalize(vector(i, 0)), n = glm::normalize(vector(i, 1));
    if (std::abs(glm::dot(d, n)) < 0.1) continue;
    const double width = 0.2;
    const auto [a, b] = surface_patch(width, d, n);
    EXPECT_NEAR(glm::dot(a, n), 0, tolerance);
    EXPECT_NEAR(glm::dot(b, n), 0, tolerance);
    const glm::dvec3 across_a = a - glm::dot(a, d) * d, across_b = b - glm::dot(b, d) * d;
    EXPECT_NEAR(glm::length(across_a), width, tolerance);
    EXPECT_NEAR(glm::length(across_b), width, tolerance);
    EXPECT_NEAR(glm::dot(across_a, across_b), 0, tolerance);
  }
}

TEST(SurfacePatch, IsASquareHeadOnAndFiniteAtGrazing) {
  for (const glm::dvec3& n : {glm::dvec3(0, 0, 1), {1, 0, 0}, {0, -1, 0}, {0.6, 0, 0.8}}) {
    const auto [a, b] = surface_patch(2, -n, n);
    EXPECT_NEAR(glm::length(a), 2, tolerance);
    EXPECT_NEAR(glm::length(b), 2, tolerance);
    EXPECT_NEAR(glm::dot(a, b), 0, tolerance);
    EXPECT_NEAR(glm::dot(a, n), 0, tolerance);
  }
  const auto [a, b] = surface_patch(2, {1, 0, 0}, {0, 0, 1});
  EXPECT_NEAR(glm::length(a), 2, tolerance);
  EXPECT_NEAR(glm::length(b), 2 / least_patch_cosine, 1e-9);
}

// Differences of the texture coordinates where neighbouring rays intersect the triangle's plane.
TEST(Footprint, MatchesTheDifferencesOfNeighbouringRays) {
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const std::array p{vector(i, 0), vector(i, 1), vector(i, 2)};
    const std::array uv{glm::dvec2(vector(i, 3)), glm::dvec2(vector(i, 4)),
                        glm::dvec2(vector(i, 5))};
    const glm::dvec3 area = glm::cross(p[1] - p[0], p[2] - p[0]);
    const glm::dvec3 n = glm::normalize(area), d = glm::normalize(vector(i, 6));
    const glm::dvec2 s = uv[1] - uv[0], t = uv[2] - uv[0];
    if (glm::length(area) < 0.1 || std::abs(s.x * t.y - s.y * t.x) < 0.1) continue;
    if (std::abs(glm::dot(d, n)) < 0.1) continue;
    const auto uv_at = [&](const glm::dvec3& origin) {
      const glm::dvec3 hit = origin + glm::dot(p[0] - origin, n) / glm::dot(d, n) * d;
      const double b1 = glm::dot(glm::cross(hit - p[0], p[2] - p[0]), area) / glm::dot(area, area);
      const double b2 = glm::dot(glm::cross(p[1] - p[0], hit - p[0]), area) / glm::dot(area, area);
      return (1 - b1 - b2) * uv[0] + b1 * uv[1] + b2 * uv[2];
    };
    const SurfacePatch patch = surface_patch(0.01, d, n);
    const Footprint footprint = footprint_of(patch, tangents_of_triangle(p, uv));
    const glm::dvec3 origin = p[0] - 5.0 * d;
    const glm::dvec3 side_a = patch.a_m - glm::dot(patch.a_m, d) * d;
    const glm::dvec3 side_b = patch.b_m - glm::dot(patch.b_m, d) * d;
    const glm::dvec2 a = uv_at(origin + side_a) - uv_at(origin);
    const glm::dvec2 b = uv_at(origin + side_b) - uv_at(origin);
    EXPECT_NEAR(glm::length(footprint.a_uv - a), 0, tolerance);
    EXPECT_NEAR(glm::length(footprint.b_uv - b), 0, tolerance);
  }
}

TEST(Footprint, OnTerrainUsesMapCoordinates) {
  const glm::dvec2 gradient(0.5, -2);
  const Tangents tangents{10.0 * glm::dvec3(1, 0, gradient.x), 20.0 * glm::dvec3(0, 1, gradient.y)};
  const glm::dvec2 step(3, 4);  // metres on the map
  const glm::dvec2 uv = uv_step(tangents, {step, glm::dot(step, gradient)});
  EXPECT_NEAR(uv.x, 0.3, 1e-15);
  EXPECT_NEAR(uv.y, 0.2, 1e-15);
}

TEST(Footprint, IsAPointWithoutTextureCoordinates) {
  const std::array p{glm::dvec3(0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)};
  const Tangents tangents = tangents_of_triangle(p, {glm::dvec2(0.5), {0.5, 0.5}, {0.5, 0.5}});
  EXPECT_EQ(tangents.dp_du, glm::dvec3(0));
  const Footprint footprint = footprint_of(surface_patch(1, {0, 0, -1}, {0, 0, 1}), tangents);
  EXPECT_EQ(footprint.a_uv, glm::dvec2(0));
  EXPECT_EQ(footprint.b_uv, glm::dvec2(0));
}

}  // namespace
}  // namespace groundray::footprint_test
