#include "sensors/camera/auto_exposure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <variant>
#include <vector>

#include "core/error.h"
#include "sensors/camera/imager.h"
#include "sensors/camera/picture.h"

namespace groundray::auto_exposure_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double longest_s = 0.01;
constexpr int side = 32;

// 16 bits without noise: a level is resolved to 2e-5.
CameraSpec camera_of(ColorFilter filter, const AutoExposureSpec& automatic) {
  return {.size_px = {side, side},
          .shutter = {.exposure_s = longest_s, .automatic = automatic},
          .imager = ImagerSpec{.filter = filter,
                               .quantum_efficiency = {0.4, 0.6, 0.5},
                               .full_well_e = 3e4,
                               .gain_dn_e = 1.5,
                               .black_dn = 100,
                               .bits = 16,
                               .noise = false},
          .picture = {.encoding = PictureSpec::Encoding::Linear, .bits = 16}};
}

ImageF even_pupil() {
  ImageF pupil_sr(side, side, 1);
  std::ranges::fill(pupil_sr.values(), 0.02F);
  return pupil_sr;
}

// Every pixel is metered, so that the metered level is that of the picture.
std::vector<MeteredPixel> metered(const ImageF& radiance) {
  std::vector<MeteredPixel> all;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const auto rgb = radiance.at(x, y);
      all.push_back({{x, y}, {rgb[0], rgb[1], rgb[2]}});
    }
  }
  return all;
}

ImageF uniform(const glm::vec3& radiance) {
  ImageF image(side, side, 3);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      std::ranges::copy(std::initializer_list<float>{radiance.r, radiance.g, radiance.b},
                        image.at(x, y).begin());
  return image;
}

// Returns the values of the picture that the imager makes with the chosen exposure, 1 for white.
std::vector<double> picture(const CameraSpec& camera, const ImageF& radiance,
                            const ExposureSetting& chosen) {
  ImagerSpec spec = *camera.imager;
  spec.gain_dn_e *= chosen.gain;
  const Imager imager(spec, chosen.exposure_s);
  const ImageF electrons = imager.electrons(imager.photons(irradiance(radiance, even_pupil())), {});
  const Picture picture =
      RawDeveloper(camera.picture, spec).develop(imager.digital(electrons, {})).picture;
  std::vector<double> values;
  for (const std::uint16_t value : std::get<Image16>(picture).values())
    values.push_back(value / 65535.0);
  return values;
}

TEST(AutoExposure, BringsAUniformImageToTheTarget) {
  for (const ColorFilter filter : {ColorFilter::Mono, ColorFilter::Rggb}) {
    for (const auto metering :
         {AutoExposureSpec::Metering::Percentile, AutoExposureSpec::Metering::Mean}) {
      const CameraSpec camera = camera_of(filter, {.metering = metering, .target = 0.45});
      const ImageF light = uniform({30, 30, 30});
      const ExposureSetting chosen = choose_exposure(camera, metered(light), even_pupil());
      EXPECT_EQ(chosen.gain, 1);
      EXPECT_LT(chosen.exposure_s, longest_s);
      for (const double value : picture(camera, light, chosen)) EXPECT_NEAR(value, 0.45, 1e-4);
    }
  }
}

// The brightest channel counts: green has the target, the others are below it.
TEST(AutoExposure, ColouredLightDoesNotExceedTheTarget) {
  const CameraSpec camera = camera_of(ColorFilter::Rggb, {.target = 0.8});
  const ImageF light = uniform({10, 40, 20});
  const ExposureSetting chosen = choose_exposure(camera, metered(light), even_pupil());
  const std::vector<double> values = picture(camera, light, chosen);
  EXPECT_NEAR(std::ranges::max(values), 0.8, 1e-4);
  EXPECT_NEAR(std::ranges::min(values), 0.2, 1e-4);  // red has a quarter of green's light
}

TEST(AutoExposure, LeavesTheRequestedShareOfPixelsUnsaturated) {
  const CameraSpec camera =
      camera_of(ColorFilter::Mono, {.percentile = 75, .target = 1, .shortest_s = 1e-6});
  ImageF light(side, side, 3);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) std::ranges::fill(light.at(x, y), static_cast<float>(x + 1));
  const ExposureSetting chosen = choose_exposure(camera, metered(light), even_pupil());
  const std::vector<double> values = picture(camera, light, chosen);
  // Columns are 1, 2, ... 32 times as bright: the 24th is white, and all after it are saturated.
  EXPECT_NEAR(values[23], 1, 1e-4);
  EXPECT_NEAR(values[11], 0.5, 1e-4);
  EXPECT_NEAR(values[22], 23.0 / 24, 1e-4);
  EXPECT_EQ(values[24], 1);
}

TEST(AutoExposure, RaisesTheGainOnlyAfterTheLongestTime) {
  AutoExposureSpec automatic{.target = 0.5, .most_gain = 1e4};
  const ImageF dim = uniform({0.05F, 0.05F, 0.05F});
  const CameraSpec camera = camera_of(ColorFilter::Mono, automatic);
  const ExposureSetting chosen = choose_exposure(camera, metered(dim), even_pupil());
  EXPECT_EQ(chosen.exposure_s, longest_s);
  EXPECT_GT(chosen.gain, 1);
  for (const double value : picture(camera, dim, chosen))
    EXPECT_NEAR(value, 0.5, 0.5 * 1.5 * chosen.gain / 65535 + 1e-4);  // half an electron
  automatic.most_gain = 2;
  const ExposureSetting limited =
      choose_exposure(camera_of(ColorFilter::Mono, automatic), metered(dim), even_pupil());
  EXPECT_EQ(limited.gain, 2);
}

TEST(AutoExposure, KeepsToTheShortestTimeInBrightLight) {
  const CameraSpec camera = camera_of(ColorFilter::Mono, {.shortest_s = 1e-3});
  const ImageF bright = uniform({1e5F, 1e5F, 1e5F});
  const ExposureSetting chosen = choose_exposure(camera, metered(bright), even_pupil());
  EXPECT_EQ(chosen.exposure_s, 1e-3);
  EXPECT_EQ(chosen.gain, 1);
}

TEST(AutoExposure, DarknessTakesTheLongestTimeAndTheLargestGain) {
  const CameraSpec camera = camera_of(ColorFilter::Mono, {.most_gain = 4});
  for (const auto& light : {metered(uniform({0, 0, 0})), std::vector<MeteredPixel>{}}) {
    const ExposureSetting chosen = choose_exposure(camera, light, even_pupil());
    EXPECT_EQ(chosen.exposure_s, longest_s);
    EXPECT_EQ(chosen.gain, 4);
  }
}

TEST(AutoExposure, ListsEveryInvalidField) {
  const CameraSpec camera = camera_of(
      ColorFilter::Mono, {.percentile = 0, .target = 2, .shortest_s = 1, .most_gain = 0.5});
  EXPECT_THAT(
      [&] { choose_exposure(camera, {}, even_pupil()); },
      ThrowsMessage<Error>(AllOf(HasSubstr("percentile = 0"), HasSubstr("target = 2"),
                                 HasSubstr("shortest_s = 1"), HasSubstr("most_gain = 0.5"))));
}

TEST(Imager, CountsFullPixelsAndTheLargestDigitalNumbers) {
  const Imager imager({.full_well_e = 100, .gain_dn_e = 1, .bits = 8, .noise = false}, 1e-3);
  ImageF electrons(4, 1, 1);
  std::ranges::copy(std::initializer_list<float>{100, 99, 0, 0}, electrons.values().begin());
  Image16 digital(4, 1, 1);
  std::ranges::copy(std::initializer_list<std::uint16_t>{100, 99, 255, 254},
                    digital.values().begin());
  EXPECT_EQ(imager.saturated_share(electrons, digital), 0.5);
}

}  // namespace
}  // namespace groundray::auto_exposure_test
