#include "core/appearance/tiling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

namespace groundray::tiling_test {
namespace {

// Independent texels, far above 0, so that no result is cut off there.
Texture white_noise(int side) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<float> value(0.4f, 0.6f);
  ImageF image(side, side, 1);
  for (float& each : image.values()) each = value(random);
  return {std::move(image), Wrap::Repeat};
}

double color_at(const Texture& texture, glm::dvec2 uv, Tiling tiling = Tiling::Stochastic,
                const Footprint& footprint = {}) {
  return static_cast<double>(tiled_color(texture, uv, footprint, Filtering::Exact, tiling).g);
}

double variance_of_texels(const Texture& texture) {
  double squares = 0;
  const glm::ivec2 size = texture.size();
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const double step = static_cast<double>(texture.texel(0, x, y).g) - texture.mean().g;
      squares += step * step;
    }
  }
  return squares / (size.x * size.y);
}

TEST(Tiling, RepeatIsTheTextureItself) {
  const Texture texture = white_noise(16);
  for (double u = -3; u < 3; u += 0.37) {
    EXPECT_EQ(color_at(texture, {u, 2 * u}, Tiling::Repeat),
              static_cast<double>(texture.color({u, 2 * u}, {}, Filtering::Exact).g));
  }
}

// Mean and variance over 40000 copies, whose offsets are independent: a standard error of the mean
// of 10^6 samples, and five of them, a chance of 6e-7. Texels are distributed symmetrically, so
// that the limit to the blended colours leaves the mean and reduces the variance alone.
TEST(Tiling, StochasticPreservesMeanAndVariance) {
  const Texture texture = white_noise(32);
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> place(-100, 100);
  constexpr int count = 1'000'000;
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    const double step = color_at(texture, {place(random), place(random)}) - texture.mean().g;
    sum += step;
    squares += step * step;
  }
  EXPECT_NEAR(sum / count, 0, 5 * std::sqrt(variance_of_texels(texture) / count));
  EXPECT_GT(squares / count / variance_of_texels(texture), 0.9);
  EXPECT_LT(squares / count / variance_of_texels(texture), 1.01);
}

TEST(Tiling, StochasticHasNoPeriod) {
  const Texture texture = white_noise(32);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place(-100, 100);
  double product = 0, square = 0;
  for (int i = 0; i < 100'000; ++i) {
    const glm::dvec2 uv(place(random), place(random));
    const double a = color_at(texture, uv) - texture.mean().g;
    product += a * (color_at(texture, uv + glm::dvec2(1, 0)) - texture.mean().g);
    square += a * a;
  }
  EXPECT_LT(std::abs(product / square), 5 / std::sqrt(100'000));  // 1 for a repeat
}

TEST(Tiling, FootprintsOfCompleteCopiesGiveTheMean) {
  const Texture texture = white_noise(8);
  for (double u = 0.1; u < 5; u += 0.3) {
    const double mean = color_at(texture, {u, 3 - u}, Tiling::Stochastic, {{2, 0}, {0, 3}});
    EXPECT_NEAR(mean, texture.mean().g, 2e-7);  // roundings to float
  }
}

// A texel is 1/8 copy wide and texels differ by at most 0.2, so that interpolated colours change by
// at most 1.6 per copy along an axis; transitions between pieces add their own slopes.
TEST(Tiling, StochasticIsContinuous) {
  const Texture texture = white_noise(8);
  constexpr double step = 1e-4, steepest = 12;
  const auto at = [&](double u) {
    return static_cast<double>(
        tiled_color(texture, {u, 1 + 0.3 * (u + 2)}, {}, Filtering::Fast, Tiling::Stochastic).g);
  };
  for (double u = -2; u < 2; u += step)
    EXPECT_LT(std::abs(at(u + step) - at(u)), steepest * step) << u;
}

TEST(Tiling, FarAndInvalidPointsAreFinite) {
  const Texture texture = white_noise(8);
  for (const double u : {1e30, -1e30, std::nan("")})
    EXPECT_TRUE(std::isfinite(color_at(texture, {u, 0.5})));
}

}  // namespace
}  // namespace groundray::tiling_test
