#include "terrain/textures/ground_images.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "core/error.h"

namespace groundray::ground_images_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class EveryKindOfGround : public ::testing::TestWithParam<int> {
 protected:
  static GroundImageKind kind() { return static_cast<GroundImageKind>(GetParam()); }
};

// Returns the root mean square differences of each row, or column, to the next; the last is that
// across the seam.
template <typename At>
std::vector<double> line_differences(const At& at, int side, std::size_t channels) {
  std::vector<double> all;
  for (int line = 0; line < side; ++line) {
    double sum = 0;
    for (int i = 0; i < side; ++i) {
      for (std::size_t c = 0; c < channels; ++c) {
        const double step =
            static_cast<double>(at((line + 1) % side, i)[c]) - static_cast<double>(at(line, i)[c]);
        sum += step * step;
      }
    }
    all.push_back(std::sqrt(sum));
  }
  return all;
}

// The seam is one of `side` equal lines: it exceeds all others with a probability of 1 / side. A
// tenth more than the largest happens by chance in none of the kinds; without tiling, differences
// of the heights would be those of independent ground, many times as large.
template <typename Pixels>
void expect_seamless(const Pixels& image) {
  const auto channels = static_cast<std::size_t>(image.channels());
  for (const bool by_rows : {false, true}) {
    auto steps = line_differences(
        [&](int line, int i) { return by_rows ? image.at(i, line) : image.at(line, i); },
        image.width(), channels);
    const double seam = steps.back();
    steps.pop_back();
    const auto [least, most] = std::ranges::minmax(steps);
    EXPECT_LT(seam, 1.1 * most) << by_rows;
    EXPECT_GT(seam, 0.9 * least) << by_rows;
  }
}

TEST_P(EveryKindOfGround, RepeatsWithoutSeams) {
  const GroundImages images = make_ground_images({kind(), 3, 256, 1});
  expect_seamless(images.albedo);
  expect_seamless(images.normal);
  expect_seamless(images.height_m);
}

TEST_P(EveryKindOfGround, HasNormalsOfItsHeights) {
  constexpr int side = 256;
  constexpr double size_m = 0.5, step_m = size_m / side;
  const GroundImages images = make_ground_images({kind(), 1, side, size_m});
  const auto height_m = [&](int x, int y) {
    return static_cast<double>(images.height_m.at(x & (side - 1), y & (side - 1))[0]);
  };
  double worst = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double east = (height_m(x + 1, y) - height_m(x - 1, y)) / (2 * step_m);
      const double north = (height_m(x, y - 1) - height_m(x, y + 1)) / (2 * step_m);
      const double length = std::sqrt(east * east + north * north + 1);
      const auto texel = images.normal.at(x, y);
      const double expected[3] = {-east / length, -north / length, 1 / length};
      for (std::size_t i = 0; i < 3; ++i)
        worst = std::max(worst, std::abs(texel[i] - 127.5 * (1 + expected[i])));
    }
  }
  EXPECT_LT(worst, 0.5 + 1e-3);  // one rounding to a byte; the rest is that of float
}

TEST_P(EveryKindOfGround, HasHeightsAboutAMeanOfZero) {
  const GroundImages images = make_ground_images({kind(), 0, 256, 1});
  double sum = 0, squares = 0;
  for (const float z : images.height_m.values())
    sum += static_cast<double>(z), squares += static_cast<double>(z * z);
  const double count = 256 * 256;
  EXPECT_NEAR(sum / count, 0, 1e-7);
  // Litter, stones and ripples are millimetres to centimetres high.
  EXPECT_GT(std::sqrt(squares / count), 0.001);
  EXPECT_LT(std::sqrt(squares / count), 0.02);
}

TEST_P(EveryKindOfGround, IsEqualForAnyRunner) {
  const PassRunner backwards([](std::size_t count, const PassRunner::Work& work) {
    for (std::size_t i = count; i-- > 0;) work(i, i + 1);
  });
  const GroundImageSpec spec{kind(), 2, 256, 1};
  const GroundImages a = make_ground_images(spec), b = make_ground_images(spec, 0, backwards);
  EXPECT_TRUE(std::ranges::equal(a.albedo.values(), b.albedo.values()));
  EXPECT_TRUE(std::ranges::equal(a.normal.values(), b.normal.values()));
  EXPECT_TRUE(std::ranges::equal(a.height_m.values(), b.height_m.values()));
  EXPECT_TRUE(std::ranges::equal(a.roughness.values(), b.roughness.values()));
}

TEST_P(EveryKindOfGround, DiffersByVariant) {
  const GroundImages a = make_ground_images({kind(), 0, 64, 0.5});
  const GroundImages b = make_ground_images({kind(), 1, 64, 0.5});
  EXPECT_FALSE(std::ranges::equal(a.albedo.values(), b.albedo.values()));
}

// Returns the distance at which the autocorrelation of green along rows falls to 1/2.
double correlation_length_m(const GroundImageSpec& spec) {
  const Image8 image = make_ground_images(spec).albedo;
  const int side = spec.pixels;
  double mean = 0;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) mean += image.at(x, y)[1];
  mean /= static_cast<double>(side) * side;
  const auto correlation = [&](int shift) {
    double sum = 0;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x)
        sum += (image.at(x, y)[1] - mean) * (image.at((x + shift) & (side - 1), y)[1] - mean);
    }
    return sum;
  };
  const double half = correlation(0) / 2;
  double before = 2 * half;
  for (int shift = 1;; ++shift) {
    const double here = correlation(shift);
    if (here < half) return (shift - 1 + (before - half) / (before - here)) * spec.size_m / side;
    before = here;
  }
}

// Objects keep their size in metres, whatever the size and resolution of the images. Discs of
// diameter d correlate by 1/2 at 0.40 d: leaves of 3 to 8 cm, of which most are partly hidden, and
// stones of 6 to 50 mm between grit.
TEST(GroundImages, ContainObjectsOfTheirNaturalSizes) {
  for (const auto& [kind, least_m, most_m] :
       {std::tuple{GroundImageKind::ForestLitter, 0.003, 0.015},
        {GroundImageKind::Gravel, 0.002, 0.010},
        {GroundImageKind::ShortGrass, 0.0008, 0.003}}) {
    const double fine_m = correlation_length_m({kind, 0, 1024, 0.5});
    const double coarse_m = correlation_length_m({kind, 5, 1024, 1});
    EXPECT_GT(fine_m, least_m);
    EXPECT_LT(fine_m, most_m);
    EXPECT_NEAR(coarse_m / fine_m, 1, 0.35) << fine_m << ' ' << coarse_m;
  }
}

// The wave of the largest amplitude, by its definition, among all that repeat.
TEST(GroundImages, ContainRipplesOfSevenToTenCentimetresInSand) {
  constexpr int side = 64;  // 31 mm per pixel: coarse pixels are means
  constexpr double size_m = 2;
  const GroundImages images = make_ground_images({GroundImageKind::Sand, 0, 512, size_m});
  std::vector<double> means(std::size_t{side} * side);
  const auto index_of = [](int x, int y) {
    return static_cast<std::size_t>(y) * side + static_cast<std::size_t>(x);
  };
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 512; ++x)
      means[index_of(x / 8, y / 8)] += static_cast<double>(images.height_m.at(x, y)[0]) / 64;
  }
  double most = 0, wavelength_m = 0;
  for (int m = 0; m < side / 2; ++m) {
    for (int n = -side / 2; n < side / 2; ++n) {
      if (std::hypot(m, n) < 5) continue;  // broad swells
      std::complex<double> sum = 0;
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x)
          sum += means[index_of(x, y)] *
                 std::polar(1.0, 2 * std::numbers::pi * (m * x + n * y) / side);
      }
      if (std::abs(sum) <= most) continue;
      most = std::abs(sum);
      wavelength_m = size_m / std::hypot(m, n);
    }
  }
  EXPECT_GT(wavelength_m, 0.07);
  EXPECT_LT(wavelength_m, 0.1);
}

// What geometry of 2 cm shows is absent from the normals: their mean over squares of 8 cm tilts
// far less than that of the whole relief.
TEST(GroundImages, LeaveCoarseHeightsToGeometry) {
  const GroundImageSpec spec{GroundImageKind::Sand, 0, 256, 1};
  const GroundImages whole = make_ground_images(spec), fine = make_ground_images(spec, 0.02);
  EXPECT_TRUE(std::ranges::equal(whole.height_m.values(), fine.height_m.values()));
  const auto tilt = [](const Image8& normal) {
    double squares = 0;
    for (int block = 0; block < 256; ++block) {
      double sum = 0;
      for (int i = 0; i < 256; ++i)
        sum += normal.at(block % 16 * 16 + i % 16, block / 16 * 16 + i / 16)[0] - 127.5;
      squares += sum * sum;
    }
    return std::sqrt(squares);
  };
  EXPECT_LT(tilt(fine.normal), 0.35 * tilt(whole.normal));
}

TEST(GroundImages, RejectsEveryFaultAtOnce) {
  EXPECT_THAT(
      [] {
        make_ground_images({GroundImageKind::Moss, 0, 1000, 40});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("pixels = 1000 must be a power of two from 64 to 4096"),
                                 HasSubstr("size_m = 40 must be from 0.5 to 8"))));
}

INSTANTIATE_TEST_SUITE_P(GroundImages, EveryKindOfGround,
                         ::testing::Range(0, static_cast<int>(ground_image_names().size())),
                         [](const auto& kind) {
                           return std::string(
                               ground_image_names()[static_cast<std::size_t>(kind.param)]);
                         });

}  // namespace
}  // namespace groundray::ground_images_test
