#include "sensors/camera/imager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/error.h"
#include "test/support/margin.h"

namespace groundray::imager_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

ImageF flat(int side, double value, int channels) {
  ImageF image(side, side, channels);
  std::ranges::fill(image.values(), static_cast<float>(value));
  return image;
}

double mean_of(const auto& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(std::size(values));
}

double variance_of(const auto& values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return sum / static_cast<double>(std::size(values) - 1);
}

// The worked example: 281 lx on pixels of 3.45 um for 1/500 s are 27,140 photons and 16,280
// electrons at 550 nm with 683 lm/W. That efficacy holds at 555 nm, where there are 555/550 times
// as many.
TEST(Imager, PhotonsMatchTheWorkedExample) {
  const Imager imager(
      {.pixel_pitch_m = 3.45e-6, .full_well_e = 1e5, .dark_current_e_s = 0, .noise = false},
      1.0 / 500);
  const ImageF photons = imager.photons(flat(2, 281.0 / 683, 3));
  EXPECT_NEAR(photons.at(0, 0)[0], 27'140 * 555.0 / 550, 40);  // 281 lx has three digits
  EXPECT_NEAR(imager.electrons(photons, {}).at(0, 0)[0], 16'280 * 555.0 / 550, 25);
}

TEST(Imager, MosaicPixelsMeasureTheirColours) {
  ImageF light(4, 2, 3);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 4; ++x) {
      light.at(x, y)[0] = 1;
      light.at(x, y)[1] = 2;
      light.at(x, y)[2] = 3;
    }
  }
  const auto upper_left = [&](ColorFilter filter) {
    const ImageF photons = Imager({.filter = filter}, 0.01).photons(light);
    const double unit = photons.at(0, 0)[0] / static_cast<double>(1 + channel_of(filter, {0, 0}));
    std::vector<int> colours;
    for (const auto& [x, y] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}})
      colours.push_back(static_cast<int>(std::lround(photons.at(x, y)[0] / unit)));
    EXPECT_EQ(photons.at(0, 0)[0], photons.at(2, 0)[0]);
    return colours;
  };
  EXPECT_THAT(upper_left(ColorFilter::Rggb), ElementsAre(1, 2, 2, 3));
  EXPECT_THAT(upper_left(ColorFilter::Bggr), ElementsAre(3, 2, 2, 1));
  EXPECT_THAT(upper_left(ColorFilter::Grbg), ElementsAre(2, 1, 3, 2));
  EXPECT_THAT(upper_left(ColorFilter::Gbrg), ElementsAre(2, 3, 1, 2));
  const ImageF mono = Imager({.filter = ColorFilter::Mono}, 0.01).photons(light);
  const double luminance = 0.2126 * 1 + 0.7152 * 2 + 0.0722 * 3;
  const double red = Imager({.filter = ColorFilter::Rggb}, 0.01).photons(light).at(0, 0)[0];
  EXPECT_NEAR(mono.at(1, 1)[0] / red, luminance, 1e-6);
}

// EMVA 1288 statistics of two images of one exposure: the mean, and the temporal variance from
// their difference, so that differences between pixels cancel.
struct Transfer {
  double mean_dn, variance_dn2;
};
Transfer transfer_of(const ImagerSpec& spec, double light_w_m2, double exposure_s, int side,
                     std::uint32_t first_frame = 1) {
  const Imager imager(spec, exposure_s);
  const ImageF photons = imager.photons(flat(side, light_w_m2, 3));
  const auto image = [&](std::uint32_t frame) {
    const RandomKey key{.seed = Seed{4}, .frame = frame};
    return imager.digital(imager.electrons(photons, key), key);
  };
  const Image16 a = image(first_frame), b = image(first_frame + 1);
  std::vector<double> differences;
  for (std::size_t i = 0; i < a.values().size(); ++i)
    differences.push_back(a.values()[i] - b.values()[i]);
  return {(mean_of(a.values()) + mean_of(b.values())) / 2, variance_of(differences) / 2};
}

// A sensor with every kind of noise.
ImagerSpec noisy_sensor() {
  return {.filter = ColorFilter::Mono,
          .full_well_e = 2e4,
          .read_noise_e = 8,
          .dark_current_e_s = 2000,
          .prnu = 0.01,
          .dsnu_e = 12,
          .gain_dn_e = 0.2,
          .black_dn = 64};
}

// Photon transfer: sigma_y^2 = K^2 sigma_d^2 + 1/12 + K (mean - dark mean), here for increasing
// exposures of up to 70 % of saturation, with dark images subtracted.
TEST(Imager, PhotonTransferYieldsTheGain) {
  const ImagerSpec spec = noisy_sensor();
  // 0.05 W/m^2 on (3.45 um)^2, at 3.579e-19 J per photon.
  constexpr double light_w_m2 = 0.05, electrons_s = 997'644;
  constexpr int side = 160;
  double xx = 0, xy = 0;
  for (std::uint32_t step = 1; step <= 20; ++step) {
    const double exposure_s = 0.7 * spec.full_well_e / electrons_s * step / 20;
    const Transfer lit = transfer_of(spec, light_w_m2, exposure_s, side, 4 * step);
    const Transfer dark = transfer_of(spec, 0, exposure_s, side, 4 * step + 2);
    const double x = lit.mean_dn - dark.mean_dn;
    EXPECT_NEAR(x, spec.gain_dn_e * electrons_s * exposure_s, 0.005 * x);
    xx += x * x;
    xy += x * (lit.variance_dn2 - dark.variance_dn2);
  }
  // A variance over 25,600 pixels has a standard error of sqrt(2 / 25,600) = 0.9 %, the slope
  // through 20 of them with these weights 0.26 %: 1 % is nearly 4 standard errors.
  EXPECT_NEAR(xy / xx, spec.gain_dn_e, 0.01 * spec.gain_dn_e);
  testing::record_margin("gain", xy / xx / spec.gain_dn_e - 1, 0.01);
}

// The standard deviation over 300^2 pixels has a standard error of 0.24 %: 1 % is 4 standard
// errors.
TEST(Imager, DarkImagesYieldReadAndDarkCurrentNoise) {
  const ImagerSpec spec = noisy_sensor();
  for (const double exposure_s : {1e-5, 0.05}) {
    const Transfer dark = transfer_of(spec, 0, exposure_s, 300);
    const double dark_e = spec.dark_current_e_s * exposure_s;
    EXPECT_NEAR(dark.mean_dn, spec.black_dn + spec.gain_dn_e * dark_e,
                0.05);  // 6 standard errors, each 12 e / 300
    const double sigma_e = std::sqrt(dark.variance_dn2 - 1.0 / 12) / spec.gain_dn_e;
    EXPECT_NEAR(sigma_e, std::sqrt(64 + dark_e), 0.01 * sigma_e);
  }
}

// As EMVA 1288 measures them: variances over the image of the mean over frames, dark and at half of
// saturation, less the remaining temporal variance.
TEST(Imager, PixelsVaryByPrnuAndDsnu) {
  ImagerSpec spec = noisy_sensor();
  spec.gain_dn_e = 1;
  spec.bits = 16;
  constexpr int side = 300, frames = 6;
  const auto spatial = [&](double photons) {
    const Imager imager(spec, 1e-5);
    std::vector<double> sums(std::size_t{side} * side), squares(sums.size());
    for (std::uint32_t frame = 0; frame < frames; ++frame) {
      const RandomKey key{.seed = Seed{4}, .frame = frame};
      const Image16 image = imager.digital(imager.electrons(flat(side, photons, 1), key), key);
      for (std::size_t i = 0; i < sums.size(); ++i) {
        const double value = image.values()[i];
        sums[i] += value / frames;
        squares[i] += value * value / frames;
      }
    }
    double in_time = 0;
    for (std::size_t i = 0; i < sums.size(); ++i)
      in_time += (squares[i] - sums[i] * sums[i]) / (frames - 1) / double{side * side};
    return std::pair(mean_of(sums), variance_of(sums) - in_time);
  };
  const auto [dark, dark_variance] = spatial(0);
  const auto [half, half_variance] = spatial(1e4 / 0.6);
  // The standard deviation over 90,000 pixels has a standard error of 0.24 %, a little more after
  // the subtraction: 1 % is about 4 standard errors.
  EXPECT_NEAR(std::sqrt(dark_variance), spec.dsnu_e, 0.01 * spec.dsnu_e);
  const double prnu = std::sqrt(half_variance - dark_variance) / (half - dark);
  EXPECT_NEAR(prnu, spec.prnu, 0.01 * spec.prnu);
}

TEST(Imager, DarkCurrentDoublesWithTemperatureAndGrowsWithTime) {
  const auto dark_e = [](double temperature_c, double exposure_s) {
    const Imager imager({.dark_current_e_s = 3,
                         .reference_c = 20,
                         .temperature_c = temperature_c,
                         .doubling_k = 6,
                         .noise = false},
                        exposure_s);
    return imager.electrons(flat(1, 0, 1), {}).at(0, 0)[0];
  };
  EXPECT_NEAR(dark_e(20, 2), 6, 1e-6);
  EXPECT_NEAR(dark_e(26, 2), 12, 1e-6);
  EXPECT_NEAR(dark_e(8, 2), 1.5, 1e-6);
  EXPECT_NEAR(dark_e(20, 10), 30, 1e-5);
}

TEST(Imager, SaturatesAtTheFullWellAndClipsAtTheBits) {
  const ImagerSpec spec{
      .full_well_e = 1000, .gain_dn_e = 1, .black_dn = 10, .bits = 10, .noise = false};
  const Imager imager(spec, 0.01);
  const ImageF electrons = imager.electrons(flat(1, 1e9, 1), {});
  EXPECT_EQ(electrons.at(0, 0)[0], 1000);
  EXPECT_EQ(imager.digital(electrons, {}).at(0, 0)[0], 1010);
  ImagerSpec steep = spec;
  steep.gain_dn_e = 5;
  EXPECT_EQ(Imager(steep, 0.01).digital(electrons, {}).at(0, 0)[0], 1023);
  EXPECT_EQ(imager.digital(flat(1, -50, 1), {}).at(0, 0)[0], 0);
}

// Once the well is full, light adds no noise: read noise and the pixels' offsets remain.
TEST(Imager, FullWellsHaveReadNoiseOnly) {
  ImagerSpec spec = noisy_sensor();
  EXPECT_GT(transfer_of(spec, 0.05, 0.015, 100).variance_dn2, 300);
  const Transfer full = transfer_of(spec, 0.05, 0.04, 300);
  const double sigma_e = std::sqrt(full.variance_dn2 - 1.0 / 12) / spec.gain_dn_e;
  EXPECT_NEAR(sigma_e, spec.read_noise_e, 0.01 * spec.read_noise_e);
  EXPECT_NEAR(full.mean_dn, spec.black_dn + spec.gain_dn_e * spec.full_well_e, 0.05);
}

TEST(Imager, ElectronsAreWholeNumbers) {
  const Imager imager(noisy_sensor(), 0.001);
  for (const double photons : {0.0, 0.5, 30.0, 1e4, 1e6}) {
    const ImageF electrons = imager.electrons(flat(50, photons, 1), {.seed = Seed{1}});
    for (const float count : electrons.values()) {
      ASSERT_EQ(count, std::floor(count));
      ASSERT_GE(count, 0);
      ASSERT_LE(count, 2e4);
    }
  }
}

// Infinite, zero and not-a-number irradiances are processed like any other.
TEST(Imager, ToleratesNonFiniteAndNegativeIrradiance) {
  const Imager imager({.filter = ColorFilter::Mono, .noise = false}, 0.01);
  ImageF light(3, 1, 3);
  std::ranges::fill(light.at(0, 0), std::nanf(""));
  std::ranges::fill(light.at(1, 0), -1.0f);
  std::ranges::fill(light.at(2, 0), HUGE_VALF);
  const Image16 raw = imager.digital(imager.electrons(imager.photons(light), {}), {});
  EXPECT_THAT(raw.values(), ElementsAre(0, 0, 4000));
  ImageF nothing(1, 1, 1);
  nothing.at(0, 0)[0] = std::nanf("");
  EXPECT_EQ(imager.digital(nothing, {}).at(0, 0)[0], 0);
}

TEST(Imager, EqualKeysGiveEqualImagesOnAnyNumberOfThreads) {
  const Imager imager(noisy_sensor(), 0.001);
  const auto image = [&](const RandomKey& key, int threads) {
    Image16 raw;
    tbb::task_arena(threads).execute(
        [&] { raw = imager.digital(imager.electrons(flat(40, 500, 1), key), key); });
    return std::vector(raw.values().begin(), raw.values().end());
  };
  const RandomKey key{.seed = Seed{1}, .sensor = 2, .frame = 3};
  const auto one = image(key, 1);
  EXPECT_EQ(image(key, 2), one);
  EXPECT_EQ(image(key, 5), one);
  EXPECT_NE(image({.seed = Seed{1}, .sensor = 2, .frame = 4}, 1), one);
  EXPECT_NE(image({.seed = Seed{1}, .sensor = 3, .frame = 3}, 1), one);
  EXPECT_NE(image({.seed = Seed{2}, .sensor = 2, .frame = 3}, 1), one);
}

TEST(Imager, ErrorListsEveryFault) {
  const auto make = [](ImagerSpec spec, double exposure_s = 0.01) {
    return [spec, exposure_s] { Imager imager(spec, exposure_s); };
  };
  EXPECT_THAT(make({.pixel_pitch_m = 0, .full_well_e = 1e8}),
              ThrowsMessage<Error>(AllOf(HasSubstr("pixel_pitch_m = 0 must be positive"),
                                         HasSubstr("full_well_e = 100000000 must be from 1"))));
  EXPECT_THAT(make({.quantum_efficiency = {0.5, 60, 0.4}}),
              ThrowsMessage<Error>(HasSubstr("quantum_efficiency 60 must be > 0 and at most 4")));
  EXPECT_THAT(make({}, -1), ThrowsMessage<Error>(HasSubstr("exposure_s = -1 must be positive")));
  EXPECT_THAT(make({.bits = 17}), ThrowsMessage<Error>(HasSubstr("from 8 to 16")));
  EXPECT_THAT(make({.black_dn = 300, .bits = 8}),
              ThrowsMessage<Error>(HasSubstr("less than 255, the greatest value of 8 bits")));
  EXPECT_THAT([] { Imager({}, 0.01).photons(flat(1, 0, 1)); },
              ThrowsMessage<Error>(HasSubstr("must have 3 channels, but has 1")));
}

}  // namespace
}  // namespace groundray::imager_test
