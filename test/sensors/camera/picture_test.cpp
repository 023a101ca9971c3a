#include "sensors/camera/picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "core/error.h"
#include "core/image/srgb.h"

namespace groundray::picture_test {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using enum PictureSpec::Encoding;

constexpr std::array mosaics{ColorFilter::Rggb, ColorFilter::Bggr, ColorFilter::Grbg,
                             ColorFilter::Gbrg};

// Raw image of a uniform colour: the same number at all pixels with the same filter.
Image16 mosaic_of(ColorFilter filter, glm::ivec2 size_px, std::array<std::uint16_t, 3> color) {
  Image16 raw(size_px.x, size_px.y, 1);
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = 0; x < size_px.x; ++x)
      raw.at(x, y)[0] = color[static_cast<std::size_t>(channel_of(filter, {x, y}))];
  }
  return raw;
}

TEST(Picture, OfAConstantColourIsConstantInEveryPixel) {
  const ImagerSpec imager{.full_well_e = 1e4, .gain_dn_e = 0.4, .black_dn = 64};  // white: 4000
  const PictureSpec spec{.encoding = Linear, .bits = 16, .gains = glm::dvec3(2, 1, 1.5)};
  for (const ColorFilter filter : mosaics) {
    ImagerSpec sensor = imager;
    sensor.filter = filter;
    const RawDeveloper developer(spec, sensor);
    for (const glm::ivec2 size_px : {glm::ivec2(3, 3), glm::ivec2(37, 20), glm::ivec2(64, 5)}) {
      const auto picture = std::get<Image16>(
          developer.develop(mosaic_of(filter, size_px, {1064, 3064, 664})).picture);
      ASSERT_EQ(picture.channels(), 3);
      for (int y = 0; y < size_px.y; ++y) {
        for (int x = 0; x < size_px.x; ++x) {
          ASSERT_EQ(picture.at(x, y)[0], 32768) << x << ", " << y;  // 2 * 1000 / 4000 of 65535
          ASSERT_EQ(picture.at(x, y)[1], 49151) << x << ", " << y;
          ASSERT_EQ(picture.at(x, y)[2], 14745) << x << ", " << y;
        }
      }
    }
  }
}

// A pixel without a colour's filter takes the mean of the nearest pixels with it: 2 or 4.
double bilinear(const Image16& raw, ColorFilter filter, glm::ivec2 at, int channel) {
  if (channel_of(filter, at) == channel) return raw.at(at.x, at.y)[0];
  for (const int distance2 : {1, 2}) {
    double sum = 0;
    int count = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const glm::ivec2 near(at.x + dx, at.y + dy);
        if (dx * dx + dy * dy != distance2 || channel_of(filter, near) != channel) continue;
        sum += raw.at(near.x, near.y)[0];
        ++count;
      }
    }
    if (count > 0) return sum / count;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

TEST(Picture, DemosaicsBilinearly) {
  std::mt19937 random(3);
  Image16 raw(53, 31, 1);
  for (std::uint16_t& value : raw.values()) value = static_cast<std::uint16_t>(random());
  for (const ColorFilter filter : mosaics) {
    const RawDeveloper developer({.encoding = Linear, .bits = 16, .gains = glm::dvec3(1)},
                                 {.filter = filter, .full_well_e = 1e6, .bits = 16});
    const auto picture = std::get<Image16>(developer.develop(raw).picture);
    for (int y = 1; y < 30; ++y) {
      for (int x = 1; x < 52; ++x) {
        for (int channel = 0; channel < 3; ++channel) {
          // Means are rounded to the nearest number.
          ASSERT_NEAR(picture.at(x, y)[static_cast<std::size_t>(channel)],
                      bilinear(raw, filter, {x, y}, channel), 0.5)
              << x << ", " << y << " channel " << channel;
        }
      }
    }
  }
}

// Sums of 12-bit numbers keep their fractions: a mean of 2 or 4 numbers is exact.
TEST(Picture, RoundsOnce) {
  Image16 raw(5, 5, 1);
  raw.at(2, 1)[0] = 1;  // one of the four greens around (2, 2), red in RGGB
  const RawDeveloper developer({.encoding = Linear, .bits = 16, .gains = glm::dvec3(1)},
                               {.full_well_e = 4095, .gain_dn_e = 1});
  const auto picture = std::get<Image16>(developer.develop(raw).picture);
  EXPECT_EQ(picture.at(2, 2)[1], 4);  // 65535 / 4095 / 4
}

TEST(Picture, EncodesAsIec61966) {
  // Linear values and their encoding, from the standard's two equations: at the ends, on both sides
  // of their junction, and at the 18 % of a grey card.
  constexpr std::array<std::pair<double, double>, 6> table{{{0, 0},
                                                            {0.001, 0.01292},
                                                            {0.0031308, 0.0404499},
                                                            {0.18, 0.461356},
                                                            {0.5, 0.735357},
                                                            {1, 1}}};
  for (const auto& [linear, encoded] : table) EXPECT_NEAR(srgb_of_linear(linear), encoded, 5e-7);
  // Each of the 256 codes is reproduced from its linear value, given as a 16-bit raw image.
  const ImagerSpec sensor{
      .filter = ColorFilter::Mono, .full_well_e = 65535, .gain_dn_e = 1, .bits = 16};
  const RawDeveloper developer({.encoding = Srgb, .bits = 8}, sensor);
  Image16 raw(256, 1, 1);
  for (int code = 0; code < 256; ++code) {
    raw.at(code, 0)[0] =
        static_cast<std::uint16_t>(std::lround(65535 * linear_of_srgb(code / 255.0)));
  }
  const auto picture = std::get<Image8>(developer.develop(raw).picture);
  for (int code = 0; code < 256; ++code) EXPECT_EQ(picture.at(code, 0)[0], code);
}

// The complete chain: light of equal red, green and blue through filters of different efficiency.
TEST(Picture, ShowsGreySurfacesAsGreyAndFullPixelsAsWhite) {
  for (const ColorFilter filter : mosaics) {
    const ImagerSpec spec{
        .filter = filter, .quantum_efficiency = {0.4, 0.6, 0.3}, .black_dn = 100, .noise = false};
    const Imager imager(spec, 0.01);
    const RawDeveloper developer({.encoding = Linear, .bits = 16}, spec);
    EXPECT_EQ(developer.gains(), glm::dvec3(0.6 / 0.4, 1, 0.6 / 0.3));
    const auto picture_in = [&](float w_m2) {
      ImageF light(6, 6, 3);
      std::ranges::fill(light.values(), w_m2);
      return std::get<Image16>(
          developer.develop(imager.digital(imager.electrons(imager.photons(light), {}), {}))
              .picture);
    };
    const Image16 grey = picture_in(0.02f), white = picture_in(10);
    const double electrons = 0.02 * 3.45e-6 * 3.45e-6 * 0.01 / 3.5792e-19 * 0.6;
    // Raw numbers are rounded: half a step of 3995 from black to white, times the gain.
    for (const std::uint16_t value : grey.values())
      EXPECT_NEAR(value, 65535 * electrons * 0.4 / 3995, 65535 / 3995.0);
    EXPECT_THAT(white.values(), Each(65535));
  }
}

TEST(Picture, OfAMonochromeSensorIsGrey) {
  ImagerSpec spec{.filter = ColorFilter::Mono, .full_well_e = 1e4, .gain_dn_e = 0.4};
  Image16 raw(2, 1, 1);
  raw.at(0, 0)[0] = 2000;
  raw.at(1, 0)[0] = 4095;
  const auto picture =
      std::get<Image8>(RawDeveloper({.encoding = Linear, .bits = 8}, spec).develop(raw).picture);
  EXPECT_EQ(picture.channels(), 1);
  EXPECT_THAT(picture.values(), ::testing::ElementsAre(128, 255));
}

// Below saturation, light of any colour is made grey if all surfaces are grey: raw numbers of each
// channel are its efficiency times the light times the surface's reflectance.
TEST(Picture, AutomaticWhiteBalanceMakesGreySurfacesGrey) {
  const ImagerSpec imager{.filter = ColorFilter::Rggb,
                          .quantum_efficiency = glm::dvec3(0.3, 0.6, 0.45),
                          .full_well_e = 1e4,
                          .gain_dn_e = 0.4,
                          .black_dn = 64};
  const glm::dvec3 light(1.4, 1, 0.7);
  Image16 raw(64, 400, 1);
  for (int y = 0; y < 400; ++y) {
    for (int x = 0; x < 64; ++x) {
      const auto c = static_cast<glm::length_t>(channel_of(imager.filter, {x, y}));
      const double reflectance = 0.1 + 0.8 * y / 400;
      raw.at(x, y)[0] = static_cast<std::uint16_t>(
          std::round(64 + 3000 * imager.quantum_efficiency[c] * light[c] * reflectance));
    }
  }
  const RawDeveloper developer({.encoding = Linear, .bits = 16, .balances_white = true}, imager);
  const DevelopedPicture developed = developer.develop(raw);
  const glm::dvec3 seen = imager.quantum_efficiency * light;
  const glm::dvec3 expected = seen.g / seen, gains = developed.gains / developed.gains.g;
  EXPECT_NEAR(gains.r, expected.r, 2e-3);  // the outermost rows are copies of their neighbours
  EXPECT_NEAR(gains.b, expected.b, 2e-3);
  EXPECT_EQ(std::min({developed.gains.r, developed.gains.g, developed.gains.b}), 1);
  const auto& picture = std::get<Image16>(developed.picture);
  for (int y = 1; y < 399; ++y) {
    const auto pixel = picture.at(20, y);
    EXPECT_NEAR(pixel[0], pixel[1], 65535 / 4000.0 * 3) << y;
    EXPECT_NEAR(pixel[2], pixel[1], 65535 / 4000.0 * 3) << y;
  }
}

// A meadow is green, and stays so: gains are within a factor of 2 of the fixed ones.
TEST(Picture, AutomaticWhiteBalanceIsLimited) {
  const ImagerSpec imager{.filter = ColorFilter::Rggb, .full_well_e = 1e4, .gain_dn_e = 0.4};
  const RawDeveloper developer({.balances_white = true}, imager);
  const glm::dvec3 green =
      developer.develop(mosaic_of(imager.filter, {8, 8}, {100, 3000, 50})).gains;
  EXPECT_NEAR(green.r / green.g, 2, 1e-12);
  EXPECT_NEAR(green.b / green.g, 2, 1e-12);
  const glm::dvec3 dark = developer.develop(mosaic_of(imager.filter, {8, 8}, {0, 0, 0})).gains;
  EXPECT_EQ(dark, developer.gains());
}

// Half of the pixels at a and half at b have a log-mean of sqrt(a b).
TEST(Picture, ToneCurveLiftsTheLogMeanToItsKey) {
  const ImagerSpec imager{.filter = ColorFilter::Mono, .full_well_e = 1e4, .gain_dn_e = 0.4};
  Image16 raw(4, 4, 1);
  for (int i = 0; i < 16; ++i) raw.values()[static_cast<std::size_t>(i)] = i % 2 == 0 ? 40 : 1000;
  const RawDeveloper developer({.encoding = Linear, .bits = 16, .tone_key = 0.2}, imager);
  const DevelopedPicture developed = developer.develop(raw);
  const double lift = 0.2 / std::sqrt(0.01 * 0.25);
  EXPECT_NEAR(developed.lift, lift, 1e-9);
  // Photographic tone reproduction: L (1 + L / white^2) / (1 + L), with L = lift x and white =
  // lift.
  const auto toned = [&](double x) {
    const double scaled = lift * x;
    return scaled * (1 + scaled / (lift * lift)) / (1 + scaled);
  };
  const auto& values = std::get<Image16>(developed.picture).values();
  EXPECT_NEAR(values[0], 65535 * toned(0.01), 0.51);
  EXPECT_NEAR(values[1], 65535 * toned(0.25), 0.51);
  // A bright image is not darkened.
  for (std::uint16_t& value : raw.values()) value = 3000;
  EXPECT_EQ(developer.develop(raw).lift, 1);
  EXPECT_EQ(std::get<Image16>(developer.develop(raw).picture).values()[0], 49151);
}

TEST(Picture, ErrorListsEveryFault) {
  EXPECT_THAT([] { RawDeveloper({.bits = 12, .gains = glm::dvec3(1, 0, 1)}, {}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("bits = 12 must be 8 or 16"),
                                         HasSubstr("gain 0 must be positive"))));
  EXPECT_THAT([] { RawDeveloper({}, {.full_well_e = 1, .gain_dn_e = 0.1}); },
              ThrowsMessage<Error>(HasSubstr("raise gain_dn_e")));
  EXPECT_THAT(
      [] {
        RawDeveloper({.gains = glm::dvec3(1), .balances_white = true, .tone_key = 1},
                     {.filter = ColorFilter::Mono});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("gains are set, but an automatic white balance"),
                                 HasSubstr("a mono imager has no colours"),
                                 HasSubstr("key = 1 must be between 0 and 1"))));
  const RawDeveloper developer({}, {});
  EXPECT_THAT([&] { developer.develop(Image16(4, 4, 3)); },
              ThrowsMessage<Error>(HasSubstr("must have 1 channel, but has 3")));
  EXPECT_THAT([&] { developer.develop(Image16(4, 2, 1)); },
              ThrowsMessage<Error>(HasSubstr("a mosaic of 4 x 2 px lacks some colours")));
}

}  // namespace
}  // namespace groundray::picture_test
