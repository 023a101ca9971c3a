#include "terrain/relief/periodic_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"

namespace groundray::periodic_image_test {
namespace {

ImageF noise(int width, int height) {
  ImageF image(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at(x, y)[0] = static_cast<float>(
          random_uniform({Seed{1}, 0, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)})
              .x);
    }
  }
  return image;
}

TEST(PeriodicImage, ReproducesItsOwnPixels) {
  const ImageF image = noise(16, 8);
  const auto values = sample_periodic(image, {16, 8}, {1, 1});
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(values[i], image.values()[i]);
}

TEST(PeriodicImage, InterpolatesBilinearlyAcrossItsSides) {
  const ImageF image = noise(5, 3);
  // 2 copies on 32 samples: the 5 pixels of each cover 16 samples.
  const auto values = sample_periodic(image, {32, 8}, {2, 1});
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 32; ++x) {
      const double u = x * 10 / 32.0, v = y * 3 / 8.0;
      const int i = static_cast<int>(u), j = static_cast<int>(v);
      const auto at = [&](int c, int r) -> double { return image.at(c % 5, r % 3)[0]; };
      const double expected = std::lerp(std::lerp(at(i, j), at(i + 1, j), u - i),
                                        std::lerp(at(i, j + 1), at(i + 1, j + 1), u - i), v - j);
      EXPECT_NEAR(values[static_cast<std::size_t>(y * 32 + x)], expected, 1e-14);
    }
  }
}

// Detail finer than the sampling does not alias, and the mean is preserved.
TEST(PeriodicImage, AveragesFinePixels) {
  ImageF image(64, 64, 1);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) image.at(x, y)[0] = (x + y) % 2 == 0 ? 1.0f : 0.0f;
  }
  for (const double value : sample_periodic(image, {16, 16}, {1, 1}))
    EXPECT_NEAR(value, 0.5, 1e-14);
  const ImageF rough = noise(60, 36);
  double mean = 0, sampled_mean = 0;
  for (const float value : rough.values()) mean += value / (60.0 * 36);
  for (const double value : sample_periodic(rough, {30, 12}, {1, 1})) sampled_mean += value / 360;
  EXPECT_NEAR(sampled_mean, mean, 1e-13);
}

TEST(PeriodicImage, OnePixelIsConstant) {
  for (const double value : sample_periodic(noise(1, 1), {8, 4}, {3, 2}))
    EXPECT_EQ(value, noise(1, 1).at(0, 0)[0]);
}

}  // namespace
}  // namespace groundray::periodic_image_test
