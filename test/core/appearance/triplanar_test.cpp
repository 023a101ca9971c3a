#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "core/appearance/texture.h"
#include "core/random.h"

namespace groundray::triplanar_test {
namespace {

constexpr float ulp = std::numeric_limits<float>::epsilon();

glm::dvec3 vector(std::uint32_t i, std::uint32_t k) {
  const glm::dvec2 xy = random_uniform({Seed{41}, 0, i, 2 * k});
  const glm::dvec2 z = random_uniform({Seed{41}, 0, i, 2 * k + 1});
  return 2.0 * glm::dvec3(xy, z.x) - 1.0;
}

Texture noise(int channels) {
  ImageF image(8, 8, channels);
  std::uint32_t i = 0;
  for (float& value : image.values()) {
    value = static_cast<float>(random_uniform({Seed{42}, 0, i++}).x);
  }
  return Texture(std::move(image), Wrap::Repeat);
}

TEST(Triplanar, WeightsAreAPartitionOfUnity) {
  for (std::uint32_t i = 0; i < 10'000; ++i) {
    const glm::dvec3 weights = triplanar_weights(glm::normalize(vector(i, 0)));
    EXPECT_NEAR(weights.x + weights.y + weights.z, 1, 1e-15);
    EXPECT_GE(std::min({weights.x, weights.y, weights.z}), 0);
  }
}

TEST(Triplanar, WeightsAreExactOnAxesAndBisectors) {
  EXPECT_EQ(triplanar_weights({0, 0, 1}), glm::dvec3(0, 0, 1));
  EXPECT_EQ(triplanar_weights({0, -1, 0}), glm::dvec3(0, 1, 0));
  const double tilt = 23 / 57.29577951308232;
  EXPECT_EQ(triplanar_weights({std::sin(tilt), 0, std::cos(tilt)}), glm::dvec3(0, 0, 1));
  const glm::dvec3 corner = triplanar_weights(glm::dvec3(1, 1, -1) / std::sqrt(3.0));
  for (glm::length_t i = 0; i < 3; ++i) EXPECT_NEAR(corner[i], 1 / 3., 1e-15);
}

// Bounds the change per radian of the normal by finite differences: no jumps.
TEST(Triplanar, WeightsAreContinuous) {
  for (std::uint32_t i = 0; i < 10'000; ++i) {
    const glm::dvec3 normal = glm::normalize(vector(i, 0));
    const glm::dvec3 near = glm::normalize(normal + 1e-6 * vector(i, 1));
    EXPECT_LT(glm::length(triplanar_weights(normal) - triplanar_weights(near)), 2e-5);
  }
}

TEST(Triplanar, FlatGroundUsesTheHorizontalProjection) {
  const Texture texture = noise(3);
  const SurfacePatch patch{{0.3, 0, 0}, {0, 0.4, 0}};
  const glm::vec3 color =
      triplanar_color(texture, {12.3, -4.5, 99}, {0, 0, 1}, patch, 2, Filtering::Exact);
  EXPECT_EQ(color, texture.color({6.15, -2.25}, {{0.15, 0}, {0, 0.2}}, Filtering::Exact));
  const glm::vec3 wall =
      triplanar_color(texture, {1, 2, 3}, {0, 1, 0}, {{1, 0, 0}, {0, 0, 1}}, 2, Filtering::Fast);
  EXPECT_EQ(wall, texture.color({0.5, 1.5}, {{0.5, 0}, {0, 0.5}}, Filtering::Fast));
}

TEST(Triplanar, KeepsAUniformColor) {
  ImageF image(1, 1, 3);
  for (float& value : image.values()) value = 0.3f;
  const Texture texture(image, Wrap::Repeat);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const glm::vec3 color = triplanar_color(texture, vector(i, 1), glm::normalize(vector(i, 0)),
                                            {vector(i, 2), vector(i, 3)}, 1, Filtering::Fast);
    for (glm::length_t k = 0; k < 3; ++k) EXPECT_NEAR(color[k], 0.3f, 4 * ulp);
  }
}

}  // namespace
}  // namespace groundray::triplanar_test
