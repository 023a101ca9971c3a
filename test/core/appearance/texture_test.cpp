#include "core/appearance/texture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "core/error.h"

namespace groundray::texture_test {
namespace {

using ::testing::HasSubstr;
using Generator = std::mt19937_64;

// Values are at most 1, and each of the few operations on them rounds by at most half of this.
constexpr double ulp = std::numeric_limits<float>::epsilon();

double uniform(Generator& generator, double low, double high) {
  return low + (high - low) * static_cast<double>(generator() >> 11) * 0x1p-53;
}

Image8 noise8(int width, int height, int channels, std::uint64_t seed) {
  Generator generator(seed);
  Image8 image(width, height, channels);
  for (std::uint8_t& value : image.values()) value = static_cast<std::uint8_t>(generator() >> 56);
  return image;
}

ImageF noise_f(int width, int height, int channels, std::uint64_t seed) {
  Generator generator(seed);
  ImageF image(width, height, channels);
  for (float& value : image.values()) value = static_cast<float>(uniform(generator, 0, 1));
  return image;
}

// Mean of a level, summed texel by texel.
glm::dvec4 level_mean(const Texture& texture, int level) {
  const glm::ivec2 size = texture.size(level);
  glm::dvec4 sum(0);
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column) {
      sum += glm::dvec4(texture.texel(level, column, row));
    }
  }
  return sum / (1.0 * size.x * size.y);
}

void expect_near(const glm::dvec3& actual, const glm::dvec3& expected, double tolerance) {
  for (glm::length_t i = 0; i < 3; ++i) EXPECT_NEAR(actual[i], expected[i], tolerance);
}

glm::dvec2 random_uv(Generator& generator, double low, double high) {
  return {uniform(generator, low, high), uniform(generator, low, high)};
}

Footprint random_footprint(Generator& generator, double size) {
  return {random_uv(generator, -size, size), random_uv(generator, -size, size)};
}

TEST(Texture, VIncreasesUpwardsAndTexelCentresAreAtHalves) {
  const ImageF image = noise_f(5, 3, 3, 1);
  const Texture texture(image, Wrap::Clamp);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 5; ++column) {
      const glm::dvec2 uv((column + 0.5) / 5, 1 - (row + 0.5) / 3);
      const auto texel = image.at(column, row);
      expect_near(texture.color(uv), {texel[0], texel[1], texel[2]}, 4 * ulp);
    }
  }
}

// A function linear in u and v is reproduced exactly by interpolation.
TEST(Texture, LinearRampsAreReproduced) {
  Generator generator(2);
  ImageF image(17, 9, 3);
  const auto ramp = [](double x, double y) { return glm::dvec3(x / 17, y / 9, (x + 2 * y) / 35); };
  for (int row = 0; row < 9; ++row) {
    for (int column = 0; column < 17; ++column) {
      const glm::dvec3 value = ramp(column + 0.5, row + 0.5);
      for (glm::length_t i = 0; i < 3; ++i) {
        image.at(column, row)[static_cast<std::size_t>(i)] = static_cast<float>(value[i]);
      }
    }
  }
  for (const Wrap wrap : {Wrap::Repeat, Wrap::Clamp}) {
    const Texture texture(image, wrap);
    for (int i = 0; i < 1000; ++i) {
      const double x = uniform(generator, 0.5, 16.5), y = uniform(generator, 0.5, 8.5);
      expect_near(texture.color({x / 17, 1 - y / 9}), ramp(x, y), 8 * ulp);
    }
  }
}

TEST(Texture, RepeatWrapsAcrossSeams) {
  const ImageF image = noise_f(4, 4, 1, 3);
  const Texture texture(image, Wrap::Repeat);
  const double left = image.at(0, 3)[0], right = image.at(3, 3)[0];
  const double v = 0.125;
  EXPECT_NEAR(texture.color({0, v}).x, (left + right) / 2, 4 * ulp);
  EXPECT_NEAR(texture.color({1, v}).x, (left + right) / 2, 4 * ulp);
  EXPECT_NEAR(texture.color({-1e-300, v}).x, (left + right) / 2, 4 * ulp);
  Generator generator(3);
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec2 uv = random_uv(generator, 0, 1);
    // Far from the origin u itself is known only to 1e-16 of its size, and noise changes by up to 4
    // per unit of u.
    expect_near(texture.color(uv + glm::dvec2(1e6, -2e6)), texture.color(uv), 2e-9 + 4 * ulp);
  }
}

TEST(Texture, ClampExtendsTheBorder) {
  const ImageF image = noise_f(4, 4, 1, 4);
  const Texture texture(image, Wrap::Clamp);
  for (const double u : {-1e9, -0.5, 0.0, 0.125}) {
    EXPECT_EQ(texture.color({u, 0.125}).x, image.at(0, 3)[0]);
    EXPECT_EQ(texture.color({1 - u, 1 - u}).x, image.at(3, 0)[0]);
  }
}

// The inverse of the table is the encoding of IEC 61966-2-1.
TEST(Texture, SrgbBytesAreDecodedAsInIec61966) {
  Image8 image(256, 1, 1);
  for (int i = 0; i < 256; ++i) image.at(i, 0)[0] = static_cast<std::uint8_t>(i);
  const Texture srgb(image, Encoding::Srgb, Wrap::Clamp);
  const Texture linear(image, Encoding::Linear, Wrap::Clamp);
  for (int i = 0; i < 256; ++i) {
    const double light = srgb.texel(0, i, 0).x;
    const double code =
        light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
    EXPECT_NEAR(255 * code, i, 255 * 4 * ulp);
    EXPECT_EQ(linear.texel(0, i, 0).x, static_cast<float>(i) / 255);
  }
  EXPECT_EQ(srgb.texel(0, 0, 0).x, 0);
  EXPECT_EQ(srgb.texel(0, 255, 0).x, 1);
}

TEST(Texture, AlphaIsLinearForEveryEncoding) {
  Image8 image(1, 1, 4);
  for (std::uint8_t& value : image.values()) value = 51;
  EXPECT_EQ(Texture(image, Encoding::Srgb, Wrap::Clamp).texel(0, 0, 0).w, 0.2f);
}

TEST(Texture, EveryMipLevelHasTheMeanOfTheImage) {
  for (const auto& [width, height] :
       {std::pair(1, 1), {2, 2}, {3, 3}, {5, 3}, {7, 7}, {13, 1}, {64, 32}, {33, 17}, {100, 37}}) {
    const Texture bytes(noise8(width, height, 4, 5), Encoding::Srgb, Wrap::Repeat);
    const Texture floats(noise_f(width, height, 4, 6), Wrap::Repeat);
    EXPECT_EQ(bytes.size(bytes.levels() - 1), glm::ivec2(1));
    for (int level = 0; level < bytes.levels(); ++level) {
      for (glm::length_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(level_mean(bytes, level)[i], bytes.mean()[i], level * 0x1p-17 + ulp)
            << width << " x " << height << ", level " << level;
        EXPECT_NEAR(level_mean(floats, level)[i], floats.mean()[i], (level + 1) * ulp);
      }
    }
  }
}

TEST(Texture, MipLevelsOfPowersOfTwoAreMeansOfSquares) {
  const Texture texture(noise8(64, 32, 3, 7), Encoding::Srgb, Wrap::Repeat);
  for (int level = 1; level < 6; ++level) {
    const int side = 1 << level;
    const glm::ivec2 size = texture.size(level);
    ASSERT_EQ(size, glm::ivec2(64, 32) / side);
    for (int row = 0; row < size.y; ++row) {
      for (int column = 0; column < size.x; ++column) {
        glm::dvec4 sum(0);
        for (int i = 0; i < side * side; ++i) {
          sum += glm::dvec4(texture.texel(0, column * side + i % side, row * side + i / side));
        }
        const glm::dvec3 mean = glm::dvec3(sum) / (1.0 * side * side);
        expect_near(texture.texel(level, column, row), mean, level * 0x1p-17 + ulp);
      }
    }
  }
}

TEST(Texture, MipLevelsUseLimitedMemory) {
  const Texture texture(Image8(512, 512, 4), Encoding::Srgb, Wrap::Repeat);
  EXPECT_LT(static_cast<double>(texture.memory_bytes()), 512 * 512 * 4 * (1 + 2 / 3. + 0.25));
}

TEST(Texture, OneTexelIsAUniformColor) {
  Generator generator(8);
  const Texture texture(noise8(1, 1, 3, 8), Encoding::Srgb, Wrap::Repeat);
  const glm::dvec3 color = texture.mean();
  EXPECT_EQ(texture.levels(), 1);
  for (int i = 0; i < 100; ++i) {
    const glm::dvec2 uv = random_uv(generator, -3, 3);
    const Footprint footprint = random_footprint(generator, i);
    expect_near(texture.color(uv), color, ulp);
    expect_near(texture.color(uv, footprint, Filtering::Fast), color, 4 * ulp);
    expect_near(texture.color(uv, footprint, Filtering::Exact), color, ulp);
  }
}

// Copies of a parallelogram whose sides are whole repeats of the image tile the plane, wherever it
// lies: it contains each texel equally often.
TEST(Texture, ExactMeanOverLatticeCellsIsTheMean) {
  Generator generator(9);
  const Texture texture(noise8(7, 5, 3, 9), Encoding::Srgb, Wrap::Repeat);
  for (const Footprint& cell :
       {Footprint{{1, 0}, {0, 1}}, {{2, 1}, {-1, 3}}, {{0, 1}, {5, 0}}, {{12, 5}, {-7, -3}}}) {
    for (int i = 0; i < 20; ++i) {
      const glm::dvec2 uv = random_uv(generator, -2, 2);
      expect_near(texture.color(uv, cell, Filtering::Exact), texture.mean(), ulp);
    }
  }
}

TEST(Texture, ExactMeanOverAClampedImageIsItsMean) {
  const Texture texture(noise8(7, 5, 3, 10), Encoding::Srgb, Wrap::Clamp);
  const Footprint whole{{1, 0}, {0, 1}};
  expect_near(texture.color({0.5, 0.5}, whole, Filtering::Exact), texture.mean(), ulp);
}

TEST(Texture, DistantCheckerboardsAreGrey) {
  ImageF image(64, 64, 1);
  for (int row = 0; row < 64; ++row) {
    for (int column = 0; column < 64; ++column) {
      image.at(column, row)[0] = static_cast<float>((row + column) % 2);
    }
  }
  const Texture texture(image, Wrap::Repeat);
  Generator generator(11);
  for (int i = 0; i < 100; ++i) {
    const glm::dvec2 uv = random_uv(generator, 0, 1);
    const Footprint squares{{2 * (1 + i % 5) / 64., 0}, {0, 2 / 64.}};  // whole pairs of texels
    expect_near(texture.color(uv, squares, Filtering::Exact), glm::dvec3(0.5), ulp);
    const Footprint wide{{0.1, 0.02}, {-0.03, 0.08}};
    expect_near(texture.color(uv, wide, Filtering::Fast), glm::dvec3(0.5), ulp);
  }
}

// The mean over an axis-aligned box weights each texel by its overlap along each axis.
TEST(Texture, ExactMeanOverAxisAlignedBoxesIsWeightedByOverlap) {
  Generator generator(12);
  const ImageF image = noise_f(8, 6, 1, 12);
  const Texture repeat(image, Wrap::Repeat), clamp(image, Wrap::Clamp);
  const auto overlap = [](double begin, double end, int cell) {
    return std::max(0.0, std::min(end, cell + 1.0) - std::max(begin, 1.0 * cell));
  };
  for (int i = 0; i < 200; ++i) {
    const double x = uniform(generator, -8, 16), y = uniform(generator, -6, 12);
    const double width = uniform(generator, 0.01, 20), height = uniform(generator, 0.01, 20);
    double repeated = 0, clamped = 0;
    for (int row = -20; row < 30; ++row) {
      for (int column = -20; column < 40; ++column) {
        const double share = overlap(x - width / 2, x + width / 2, column) *
                             overlap(y - height / 2, y + height / 2, row) / (width * height);
        repeated += share * image.at((column + 80) % 8, (row + 60) % 6)[0];
        clamped += share * image.at(std::clamp(column, 0, 7), std::clamp(row, 0, 5))[0];
      }
    }
    const glm::dvec2 uv(x / 8, 1 - y / 6);
    const Footprint box{{0, height / 6}, {-width / 8, 0}};
    EXPECT_NEAR(repeat.color(uv, box, Filtering::Exact).x, repeated, ulp);
    EXPECT_NEAR(clamp.color(uv, box, Filtering::Exact).x, clamped, ulp);
  }
}

// One sample in each of n x n strata of the footprint. Only strata cut by a texel's side add
// variance, at most 1/4 each; a line cuts at most 2 n of them. With m lines the variance is
// therefore at most 2 n m / 4 / n^4; 5 standard deviations: p < 6e-7 for each of 100.
TEST(Texture, ExactMeanIsTheLimitOfSampling) {
  Generator generator(13);
  const ImageF image = noise_f(9, 7, 1, 13);
  constexpr int n = 150;
  for (const Wrap wrap : {Wrap::Repeat, Wrap::Clamp}) {
    const Texture texture(image, wrap);
    for (int k = 0; k < 50; ++k) {
      const glm::dvec2 uv = random_uv(generator, -1, 2);
      const Footprint footprint = random_footprint(generator, 0.02 + 0.02 * k);
      double sum = 0;
      for (int i = 0; i < n * n; ++i) {
        const double s = (i % n + uniform(generator, 0, 1)) / n - 0.5;
        const int row = i / n;
        const double t = (row + uniform(generator, 0, 1)) / n - 0.5;
        const glm::dvec2 at = uv + s * footprint.a_uv + t * footprint.b_uv;
        glm::ivec2 texel(glm::floor(glm::dvec2(at.x * 9, (1 - at.y) * 7)));
        if (wrap == Wrap::Repeat) {
          texel = {(texel.x + 900) % 9, (texel.y + 700) % 7};
        } else {
          texel = glm::clamp(texel, glm::ivec2(0), glm::ivec2(8, 6));
        }
        sum += image.at(texel.x, texel.y)[0];
      }
      const glm::dvec2 reach = (glm::abs(footprint.a_uv) + glm::abs(footprint.b_uv));
      const double lines = reach.x * 9 + reach.y * 7 + 2;
      const double deviation = std::sqrt(lines / 2) * std::pow(n, -1.5);
      EXPECT_NEAR(texture.color(uv, footprint, Filtering::Exact).x, sum / (n * n), 5 * deviation);
    }
  }
}

// A footprint that shrinks to a point or a line converges to the value at the point or the mean
// along the line.
TEST(Texture, ExactMeanOfThinFootprintsConvergesToPointsAndLines) {
  const ImageF image = noise_f(8, 1, 1, 14);
  const Texture texture(image, Wrap::Repeat);
  EXPECT_NEAR(texture.color({0.3, 0.5}, {}, Filtering::Exact).x, image.at(2, 0)[0], ulp);
  // From 1.5 to 4.5 texels; rounding of corners contributes 1e-16 * 8 / 1e-6 of the area.
  const double line =
      (0.5 * image.at(1, 0)[0] + image.at(2, 0)[0] + image.at(3, 0)[0] + 0.5 * image.at(4, 0)[0]) /
      3;
  for (const Footprint& thin : {Footprint{{3 / 8., 0}, {}}, Footprint{{}, {3 / 8., 0}}}) {
    EXPECT_NEAR(texture.color({3 / 8., 0.5}, thin, Filtering::Exact).x, line, 1e-6);
  }
}

// The mean of x^2 over any kernel is the square of its centre plus its variance. Averaged over the
// positions of the centre among the texels, this also holds for the interpolation of Fast.
TEST(Texture, FastHasTheSecondMomentsOfTheFootprint) {
  constexpr int size = 1024;
  ImageF image(size, size, 2);
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      const double x = column + 0.5 - size / 2.0, y = row + 0.5 - size / 2.0;
      image.at(column, row)[0] = static_cast<float>((x * x + x * y) / 1000);
      image.at(column, row)[1] = 1;
    }
  }
  const Texture texture(image, Wrap::Clamp);
  for (const auto& [a, b] : {std::pair(glm::dvec2(4, 0), glm::dvec2(0, 4)),
                             {{11, 3}, {-2, 9}},
                             {{40, 10}, {0, 6}},
                             {{5, 30}, {3, -1}},
                             {{60, -60}, {20, 20}}}) {
    double sum = 0;
    constexpr int n = 64;  // offsets within a texel of level 6, coarser than any used here
    for (int i = 0; i < n * n; ++i) {
      const glm::dvec2 x = glm::dvec2(glm::ivec2(i % n, i / n)) - (n - 1) / 2.0;
      const Footprint footprint{glm::dvec2(a.x, -a.y) / 1024., glm::dvec2(b.x, -b.y) / 1024.};
      const glm::dvec2 uv(0.5 + x.x / size, 0.5 - x.y / size);
      sum += texture.color(uv, footprint, Filtering::Fast).x * 1000. - (x.x * x.x + x.x * x.y);
    }
    const double expected = (a.x * a.x + b.x * b.x + a.x * a.y + b.x * b.y) / 12;
    EXPECT_NEAR(sum / (n * n), expected, 0.01 * (glm::dot(a, a) + glm::dot(b, b)) / 12);
  }
}

// The values of docs/reference/textures.md for noise with a standard deviation of 0.29, with a
// margin of 15 % for the sampling of 300 footprints (the standard error of such a root mean square
// is 4 %).
TEST(Texture, FastErrorOnNoiseIsAsDocumented) {
  Generator generator(17);
  const Texture texture(noise8(256, 256, 1, 17), Encoding::Srgb, Wrap::Repeat);
  constexpr int n = 300;
  for (const auto& [width, length, documented] :
       {std::tuple(0.5, 0.5, 0.085), {2., 2., 0.102}, {8., 8., 0.032}, {2., 32., 0.027}}) {
    double squares = 0;
    for (int i = 0; i < n; ++i) {
      const double turn = uniform(generator, 0, 7);
      const glm::dvec2 along(std::cos(turn), std::sin(turn)), across(-along.y, along.x);
      const Footprint footprint{length / 256 * along, width / 256 * across};
      const glm::dvec2 uv = random_uv(generator, 0, 1);
      const double error = texture.color(uv, footprint, Filtering::Fast).x -
                           texture.color(uv, footprint, Filtering::Exact).x;
      squares += error * error;
    }
    EXPECT_LT(std::sqrt(squares / n), 1.15 * documented) << width << " x " << length;
  }
}

TEST(Texture, AlphaIsInterpolatedAndThresholdedAtAHalf) {
  Generator generator(15);
  Image8 image = noise8(16, 8, 2, 15);
  for (int i = 0; i < 16 * 8; ++i) image.at(i % 16, i / 16)[0] = image.at(i % 16, i / 16)[1];
  for (const Wrap wrap : {Wrap::Repeat, Wrap::Clamp}) {
    const Texture texture(image, Encoding::Linear, wrap);
    EXPECT_TRUE(texture.has_alpha());
    for (int i = 0; i < 1000; ++i) {
      const glm::dvec2 uv = random_uv(generator, -2, 2);
      EXPECT_NEAR(texture.alpha(uv), texture.color(uv).x, 4 * ulp);  // the same values as colour
      EXPECT_EQ(texture.is_opaque(uv), texture.alpha(uv) >= 0.5f);
    }
  }
  const Texture floats(noise_f(4, 4, 4, 15), Wrap::Repeat);
  EXPECT_NEAR(floats.alpha({0.125, 0.875}), floats.texel(0, 0, 0).w, ulp);
  const Texture none(noise8(4, 4, 3, 15), Encoding::Srgb, Wrap::Repeat);
  EXPECT_FALSE(none.has_alpha());
  EXPECT_TRUE(none.is_opaque({0.3, 0.3}));
}

TEST(Texture, NonFiniteCoordinatesReturnAColorOfTheImage) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Wrap wrap : {Wrap::Repeat, Wrap::Clamp}) {
    const Texture texture(noise8(8, 8, 4, 16), Encoding::Srgb, wrap);
    for (const double bad : {inf, -inf, nan, 1e300, -1e300, 5e-324}) {
      for (const glm::dvec2 uv : {glm::dvec2(bad, 0.3), {0.3, bad}, {bad, bad}}) {
        std::vector colors{texture.color(uv), glm::vec3(texture.alpha(uv))};
        for (const Filtering filtering : {Filtering::Fast, Filtering::Exact}) {
          colors.push_back(texture.color(uv, {uv, {0, 0.1}}, filtering));
          colors.push_back(texture.color({0.5, 0.5}, {{0.1, 0}, uv}, filtering));
          colors.push_back(texture.color(uv, {{0.1, 0}, {0, 0.1}}, filtering));
        }
        for (const glm::vec3& color : colors) {
          for (glm::length_t i = 0; i < 3; ++i) EXPECT_TRUE(color[i] >= 0 && color[i] <= 1.000001f);
        }
      }
    }
  }
}

TEST(Texture, RejectsInvalidImages) {
  const auto message = [](const auto& make) {
    try {
      make();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no Error was thrown");
  };
  EXPECT_THAT(message([] { Texture({}, Encoding::Srgb, Wrap::Repeat); }),
              HasSubstr("texture: its image has 0 channels; it must have 1 (grey)"));
  EXPECT_THAT(message([] { Texture(ImageF(1, 1, 5), Wrap::Repeat); }), HasSubstr("5 channels"));
  ImageF image(2, 2, 3);
  image.at(1, 1)[2] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(message([&] { Texture(image, Wrap::Repeat); }), HasSubstr("not finite"));
}

TEST(Texture, AcceptsOnePixelOrRowsOfSixteenThousand) {
  Image8 one(1, 1, 1);
  one.at(0, 0)[0] = 255;
  const Texture dot(std::move(one), Encoding::Linear, Wrap::Repeat);
  EXPECT_EQ(dot.levels(), 1);
  EXPECT_EQ(dot.color({0.3, -7.1}), glm::vec3(1));
  EXPECT_EQ(dot.color({0.3, 0.2}, {{5, 0}, {0, 0.1}}, Filtering::Exact), glm::vec3(1));
  constexpr int width = 16384, height = 128;
  Image8 wide(width, height, 1);
  wide.at(width - 1, height - 1)[0] = 255;
  const Texture strip(std::move(wide), Encoding::Linear, Wrap::Repeat);
  EXPECT_EQ(strip.levels(), 15);
  const glm::dvec2 texel(1.0 / width, 1.0 / height);
  EXPECT_EQ(strip.color({1 - texel.x / 2, texel.y / 2}).r, 1);
  EXPECT_EQ(strip.color({1 - 1.5 * texel.x, texel.y / 2}).r, 0);
  const Footprint eight{{8 * texel.x, 0}, {0, texel.y}};
  EXPECT_NEAR(strip.color({1 - 4 * texel.x, texel.y / 2}, eight, Filtering::Exact).r, 0.125, 1e-6);
  EXPECT_NEAR(strip.mean().r, 1.0 / (width * height), 1e-12);
}

}  // namespace
}  // namespace groundray::texture_test
