#include "sensors/sky/environment_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/luminance.h"
#include "test/support/temporary_folder.h"

namespace groundray::environment_map_test {
namespace {

using groundray::testing::shared_data_folder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

constexpr double pi = std::numbers::pi;

glm::dvec3 toward(double azimuth, double polar) {
  return {std::sin(polar) * std::sin(azimuth), std::sin(polar) * std::cos(azimuth),
          std::cos(polar)};
}

ImageF filled(int width, int height, const std::function<glm::vec3(int, int)>& color) {
  ImageF image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const glm::vec3 c = color(x, y);
      std::ranges::copy(std::array{c.r, c.g, c.b}, image.at(x, y).begin());
    }
  }
  return image;
}

// Noise, black patches and one pixel that outshines all others, as in real skies.
ImageF harsh_image(int width, int height) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0, 1);
  return filled(width, height, [&](int x, int y) {
    if (x == width / 3 && y == height / 4) return glm::vec3(900, 800, 700);
    if (x > width / 2 && y > height / 2) return glm::vec3(0);
    const float r = uniform(random), g = uniform(random), b = uniform(random);
    return glm::vec3(r * r * r, g, b);
  });
}

// Integrates a function that is linear in azimuth between the columns' centres and smooth in polar
// angle between the rows' centres: there the midpoint rule is exact, and five-point Gauss-Legendre
// quadrature (Abramowitz and Stegun, table 25.4) is accurate to 1e-7. `split` is a polar angle at
// which the function is discontinuous.
glm::dvec3 integral(int width, int height, double split,
                    const std::function<glm::dvec3(const glm::dvec3&)>& f) {
  constexpr double at[] = {0, 0.538469310105683, -0.538469310105683, 0.906179845938664,
                           -0.906179845938664};
  constexpr double weight[] = {0.568888888888889, 0.478628670499366, 0.478628670499366,
                               0.236926885056189, 0.236926885056189};
  std::vector<double> bounds{0, pi, split};
  for (int y = 0; y < height; ++y) bounds.push_back(pi * (y + 0.5) / height);
  std::ranges::sort(bounds);
  glm::dvec3 sum(0);
  for (std::size_t i = 1; i < bounds.size(); ++i) {
    const double half = (bounds[i] - bounds[i - 1]) / 2, middle = (bounds[i] + bounds[i - 1]) / 2;
    for (int k = 0; k < 5; ++k) {
      const double polar = middle + half * at[k];
      for (int x = 0; x < width; ++x)
        sum += half * weight[k] * std::sin(polar) * f(toward(2 * pi * x / width, polar));
    }
  }
  return sum * (2 * pi / width);
}

// Deviation of an estimator's mean from the expected value, in standard errors.
double z_score(const EnvironmentMap& map, double expected,
               const std::function<double(const glm::dvec3&)>& f) {
  constexpr int count = 200'000;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(0, 1);
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    const double u = uniform(random);
    const DirectionSample drawn = map.sample({u, uniform(random)});
    const double value = f(drawn.direction) / drawn.pdf_per_sr;
    sum += value;
    squares += value * value;
  }
  const double mean = sum / count;
  const double variance = squares / count - mean * mean;
  return (mean - expected) / std::sqrt(variance / count);
}

double luminance_from(const EnvironmentMap& map, const glm::dvec3& direction) {
  return luminance(map.radiance(direction));
}

TEST(LatLongGrid, SolidAnglesSumToTheSphere) {
  for (const auto& [width, height] : {std::pair(1, 1), {7, 4}, {4096, 2048}}) {
    const LatLongGrid grid(width, height, 1);
    double pixels = 0, patches = 0;
    for (int y = 0; y < height; ++y) pixels += width * grid.pixel_solid_angle_sr(y);
    for (int y = 0; y <= height; ++y) patches += width * grid.patch_solid_angle_sr(y);
    // A sum of `height` terms, each with a few rounding errors.
    const double tolerance = 4 * pi * height * 4 * std::numeric_limits<double>::epsilon();
    EXPECT_NEAR(pixels, 4 * pi, tolerance);
    EXPECT_NEAR(patches, 4 * pi, tolerance);
  }
}

TEST(LatLongGrid, DirectionInvertsPosition) {
  const LatLongGrid grid(16, 8, -2);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 10'000; ++i) {
    const double scale = i % 2 == 0 ? 1 : 1e-6;  // close to the poles as well
    const glm::dvec3 d = glm::normalize(
        glm::dvec3(scale * uniform(random), scale * uniform(random), uniform(random)));
    const LatLongPlace at = grid.place(d);
    EXPECT_LT(glm::distance(grid.direction(at.left, at.patch_row, {at.across, at.sink}), d), 1e-9);
  }
}

// The image's centre looks at its azimuth, its right half clockwise of that, row 0 up.
TEST(EnvironmentMap, IsUprightAndTurnsClockwise) {
  const ImageF image = filled(4, 4, [](int x, int y) { return glm::vec3(x, y, 1); });
  const EnvironmentMap map(image, 0, RadianceScale{});
  const double polar = pi * 1.5 / 4;  // row 1
  // The columns' centres look at -135, -45, 45 and 135 degrees.
  for (int x = 0; x < 4; ++x) {
    EXPECT_NEAR(map.radiance(toward((x - 1.5) * pi / 2, polar)).r, x, 1e-12);
    EXPECT_NEAR(map.radiance(toward((x - 1.5) * pi / 2, polar)).g, 1, 1e-12);
  }
  EXPECT_NEAR(map.radiance({0, 0, 1}).g, 0, 1e-12);
  EXPECT_NEAR(map.radiance({0, 0, -1}).g, 3, 1e-12);
  EXPECT_NEAR(map.radiance(toward(0, polar)).r, 1.5, 1e-12);   // north, between columns 1 and 2
  EXPECT_NEAR(map.radiance(toward(pi, polar)).r, 1.5, 1e-12);  // south, across the seam: 3 and 0
  const EnvironmentMap turned(image, pi / 2, RadianceScale{2});
  EXPECT_NEAR(turned.radiance(toward(pi / 2 + pi / 4, polar)).r, 4, 1e-12);  // clockwise of east
}

TEST(EnvironmentMap, IrradianceOfAConstantImageIsPiTimesItsRadiance) {
  const EnvironmentMap map(filled(8, 5, [](int, int) { return glm::vec3(1, 2, 3); }), 0.3,
                           RadianceScale{0.5});
  EXPECT_LT(glm::distance(map.horizontal_irradiance(), pi * glm::dvec3(0.5, 1, 1.5)), 1e-14 * 16);
}

// L = |cos|: E = 2 pi integral of cos^2 sin = 2 pi / 3. Linear interpolation at spacing h errs by
// h^2 / 8 where the cosine is curved, and by h / 2 within h / 2 of the horizon, where a plane's
// cosine is at most h / 2.
TEST(EnvironmentMap, IrradianceOfACosineImageIsTwoThirdsOfPi) {
  constexpr int height = 256;
  const EnvironmentMap map(
      filled(2, height,
             [](int, int y) {
               return glm::vec3(std::abs(static_cast<float>(std::cos(pi * (y + 0.5) / height))));
             }),
      0, RadianceScale{});
  const double h = pi / height;
  EXPECT_NEAR(map.horizontal_irradiance().g, 2 * pi / 3, pi * h * h / 8 + 2 * pi * h * h * h / 8);
}

TEST(EnvironmentMap, IrradianceIsTheIntegralOfTheRadiance) {
  for (const auto& [width, height] : {std::pair(1, 1), {16, 8}, {9, 7}}) {
    const EnvironmentMap map(harsh_image(width, height), 0, RadianceScale{3});
    // Azimuth 0 is the edge between two columns for an even width, and a column's centre for an odd
    // one.
    const double step = width % 2 == 0 ? 0 : pi / width;
    const glm::dvec3 expected =
        integral(width, height, pi / 2, [&](const glm::dvec3& d) -> glm::dvec3 {
          const glm::dvec3 turned(d.x * std::cos(step) + d.y * std::sin(step),
                                  d.y * std::cos(step) - d.x * std::sin(step), d.z);
          return d.z > 0 ? d.z * map.radiance(turned) : glm::dvec3(0);
        });
    EXPECT_LT(glm::distance(map.horizontal_irradiance(), expected), 1e-7 * glm::length(expected));
  }
}

TEST(EnvironmentMap, IsScaledToTheRequestedIlluminance) {
  const EnvironmentMap map(harsh_image(16, 8), 0, IlluminanceScale{25'000});
  EXPECT_NEAR(683 * luminance(map.horizontal_irradiance()), 25'000, 1e-8);
}

// Estimates of three integrals from 200 000 samples each: the luminance, the irradiance of a
// horizontal plane, and that of a wall in the dark half. |z| < 4 is a significance of 6e-5 each.
TEST(EnvironmentMap, SamplingIsUnbiased) {
  const EnvironmentMap map(harsh_image(16, 8), 0, RadianceScale{});
  const std::function<double(const glm::dvec3&)> cosines[] = {
      [](const glm::dvec3&) { return 1.; }, [](const glm::dvec3& d) { return std::max(d.z, 0.); },
      [](const glm::dvec3& d) { return std::max(-d.z, 0.); }};
  for (const auto& cosine : cosines) {
    const auto f = [&](const glm::dvec3& d) { return cosine(d) * luminance_from(map, d); };
    const double expected =
        integral(16, 8, pi / 2, [&](const glm::dvec3& d) { return glm::dvec3(f(d)); }).x;
    EXPECT_LT(std::abs(z_score(map, expected, f)), 4);
  }
}

// The bins are quarters of patches: the density is bilinear on them, so its value at the centre is
// its mean. The critical value is Wilson and Hilferty's for a significance of 1e-4.
TEST(EnvironmentMap, SamplesFollowTheirDensity) {
  constexpr int width = 12, height = 6, count = 400'000;
  const EnvironmentMap map(harsh_image(width, height), 0.4, RadianceScale{});
  const LatLongGrid grid(width, height, 0.4);
  std::vector<double> seen(std::size_t{4} * width * (height + 1));
  const auto bin = [&](const LatLongPlace& at) {
    const int column = 2 * at.left + (at.across >= 0.5), row = 2 * at.patch_row + (at.sink >= 0.5);
    return static_cast<std::size_t>(row) * 2 * width + static_cast<std::size_t>(column);
  };
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < count; ++i) {
    const double u = uniform(random);
    const DirectionSample drawn = map.sample({u, uniform(random)});
    EXPECT_NEAR(glm::length(drawn.direction), 1, 1e-15 * 8);
    EXPECT_NEAR(map.pdf_per_sr(drawn.direction), drawn.pdf_per_sr, 1e-8 * drawn.pdf_per_sr + 1e-9);
    ++seen[bin(grid.place(drawn.direction))];
  }
  double chi2 = 0, total = 0;
  int bins = 0;
  for (int row = 0; row <= height; ++row) {
    for (int column = 0; column < width; ++column) {
      for (const glm::dvec2 middle :
           {glm::dvec2(0.25, 0.25), {0.75, 0.25}, {0.25, 0.75}, {0.75, 0.75}}) {
        const glm::dvec3 d = grid.direction(column, row, middle);
        const double share = map.pdf_per_sr(d) * grid.patch_solid_angle_sr(row) / 4;
        const double got = seen[bin(grid.place(d))];
        total += share;
        if (share * count < 5) {
          EXPECT_LT(got, 25);  // probability 1e-9 at an expectation of 5
          continue;
        }
        chi2 += (got - share * count) * (got - share * count) / (share * count);
        ++bins;
      }
    }
  }
  EXPECT_NEAR(total, 1, 1e-12);
  const double freedom = bins - 1, k = 2 / (9 * freedom);
  EXPECT_LT(chi2, freedom * std::pow(1 - k + 3.719 * std::sqrt(k), 3)) << bins << " bins";
}

// The condition for a low variance: no pixel's luminance exceeds its density by far.
TEST(EnvironmentMap, DensityFollowsTheLuminance) {
  const EnvironmentMap map(harsh_image(16, 8), 0, RadianceScale{});
  const double all =
      integral(16, 8, 0, [&](const glm::dvec3& d) { return glm::dvec3(luminance_from(map, d)); }).x;
  std::mt19937_64 random(23);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 10'000; ++i) {
    const double u = uniform(random);
    const DirectionSample drawn = map.sample({u, uniform(random)});
    // The density is bilinear in height, not in polar angle: next to the poles they differ by a
    // factor of 2 at most, and so does the total.
    const double ratio = luminance_from(map, drawn.direction) / drawn.pdf_per_sr / all;
    EXPECT_LT(ratio, 2.2);
    if (std::abs(drawn.direction.z) < 0.5) {
      EXPECT_NEAR(ratio, 1, 0.15);
    }
  }
}

TEST(EnvironmentMap, SamplingOfMeasuredSkiesIsUnbiased) {
  for (const char* name : {"sky.hdr", "forest.hdr"}) {
    const auto path = shared_data_folder() / "env_hdr" / name;
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
    const EnvironmentMap map(read_image_f(path), 1, IlluminanceScale{50'000});
    const double expected = 50'000.0 / 683;
    const auto f = [&](const glm::dvec3& d) { return std::max(d.z, 0.) * luminance_from(map, d); };
    EXPECT_LT(std::abs(z_score(map, expected, f)), 4) << name;
  }
}

TEST(EnvironmentMap, ErrorNamesTheFaultyPixels) {
  ImageF image = filled(4, 2, [](int, int) { return glm::vec3(1); });
  image.at(1, 0)[2] = std::numeric_limits<float>::quiet_NaN();
  image.at(3, 1)[0] = -1;
  image.at(2, 1)[1] = std::numeric_limits<float>::infinity();
  EXPECT_THAT([&] { EnvironmentMap(image, 0, RadianceScale{}); },
              ThrowsMessage<Error>(
                  AllOf(HasSubstr("pixel (1, 0) = (1, 1, nan) must be finite and >= 0"),
                        HasSubstr("pixel (2, 1) = (1, inf, 1)"),
                        HasSubstr("pixel (3, 1) = (-1, 1, 1)"), Not(HasSubstr("more such")))));
  const ImageF broken = filled(4, 2, [](int, int) { return glm::vec3(-1); });
  EXPECT_THAT([&] { EnvironmentMap(broken, 0, RadianceScale{}); },
              ThrowsMessage<Error>(HasSubstr("and 3 more such pixels")));
}

TEST(EnvironmentMap, RejectsImagesThatCannotLightAScene) {
  const ImageF black = filled(4, 2, [](int, int) { return glm::vec3(0); });
  EXPECT_THAT([&] { EnvironmentMap(black, 0, RadianceScale{}); },
              ThrowsMessage<Error>(HasSubstr("every pixel is 0")));
  const ImageF below = filled(4, 8, [](int, int y) { return glm::vec3(y == 7); });
  EXPECT_THAT([&] { EnvironmentMap(below, 0, IlluminanceScale{1000}); },
              ThrowsMessage<Error>(HasSubstr("is it upside down?")));
  EXPECT_THAT([&] { EnvironmentMap(below, 0, IlluminanceScale{-1}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("illuminance = -1 lx must be positive"),
                                         HasSubstr("is it upside down?"))));
  EXPECT_THAT([&] { EnvironmentMap(below, 0, RadianceScale{0}); },
              ThrowsMessage<Error>(HasSubstr("radiance factor = 0 must be positive")));
  EXPECT_THAT([&] { EnvironmentMap(ImageF(2, 2, 5), 0, RadianceScale{}); },
              ThrowsMessage<Error>(HasSubstr("has 5 channels")));
  EXPECT_THAT([&] { EnvironmentMap(below, std::nan(""), RadianceScale{}); },
              ThrowsMessage<Error>(HasSubstr("center_azimuth_rad = nan must be finite")));
}

TEST(EnvironmentMap, GreyImageHasEqualRedGreenAndBlue) {
  ImageF grey(2, 1, 1);
  grey.at(0, 0)[0] = grey.at(1, 0)[0] = 3;
  EXPECT_EQ(EnvironmentMap(grey, 0, RadianceScale{}).radiance({1, 0, 0}), glm::dvec3(3));
}

}  // namespace
}  // namespace groundray::environment_map_test
