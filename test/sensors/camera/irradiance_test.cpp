#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "sensors/camera/camera_spec.h"
#include "sensors/camera/imager.h"
#include "sensors/camera/lens/lens.h"
#include "test/support/margin.h"

namespace groundray::irradiance_test {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using enum ApertureSpec::Pupil;

constexpr double pitch_m = 3e-6;
// Derivatives of rays are accurate to 1e-6, the solid angle has two of them, and results are
// floats.
constexpr double tolerance = 2.2e-6;

Lens pinhole(double focal_px, glm::ivec2 size_px = {81, 61}) {
  return {Pinhole{{glm::dvec2(focal_px), glm::dvec2(size_px - 1) / 2.0}}, size_px};
}

ApertureSpec f_over(double f_number, double focal_px) {
  return {.focal_length_m = focal_px * pitch_m, .f_number = f_number};
}

TEST(Irradiance, OfAPinholeFollowsTheFourthPowerOfTheCosine) {
  for (const double focal_px : {20.0, 60.0, 500.0}) {  // up to 68 degrees from the axis
    ApertureSpec aperture = f_over(2.8, focal_px);
    aperture.transmission = 0.93;
    const ImageF sr = pupil_sr(pinhole(focal_px), aperture, pitch_m);
    for (int y = 0; y < 61; ++y) {
      for (int x = 0; x < 81; ++x) {
        const double cos = focal_px / std::hypot(x - 40, y - 30, focal_px);
        const double closed = 0.93 * pi / (4 * 2.8 * 2.8) * std::pow(cos, 4);
        ASSERT_NEAR(sr.at(x, y)[0], closed, tolerance * closed) << x << ", " << y;
        testing::record_margin("pinholes", sr.at(x, y)[0] / closed - 1, tolerance);
      }
    }
  }
}

// With a near focus the image forms at f (1 + m), the distance that a calibration yields.
TEST(Irradiance, FallsWithTheMagnificationOfTheCalibration) {
  constexpr double m = 0.2;
  const ImageF sr = pupil_sr(pinhole(500 * (1 + m)), f_over(4, 500), pitch_m);
  const double closed = pi / 64 / ((1 + m) * (1 + m));
  EXPECT_NEAR(sr.at(40, 30)[0], closed, tolerance * closed);
}

// A surface of 6366 cd/m^2 at f/4 with a transmission of 0.9 gives 281 lx.
TEST(Irradiance, MatchesTheWorkedExample) {
  ApertureSpec aperture = f_over(4, 500);
  aperture.transmission = 0.9;
  ImageF radiance(81, 61, 3);
  std::ranges::fill(radiance.values(), 6366.0f / 683);
  const ImageF light = irradiance(radiance, pupil_sr(pinhole(500), aperture, pitch_m));
  EXPECT_NEAR(light.at(40, 30)[1] * 683, 281, 0.5);
}

// Solid angle of a triangle on the unit sphere, sr.
// @see Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983).
double triangle_sr(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const double volume = std::abs(glm::dot(a, glm::cross(b, c)));
  return 2 * std::atan2(volume, 1 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
}

TEST(Irradiance, OfAFisheyeFollowsThePupilAndThePixelsSolidAngle) {
  const glm::ivec2 size_px(401, 401);
  const double focal_px = 118;  // 190 degrees across
  const Lens lens(KannalaBrandt{{glm::dvec2(focal_px), glm::dvec2(200)}, {0.02, -0.004, 0.001, 0}},
                  size_px);
  ApertureSpec aperture = f_over(2, focal_px);
  const ImageF flat = pupil_sr(lens, aperture, pitch_m);
  aperture.pupil = Turning;
  const ImageF turning = pupil_sr(lens, aperture, pitch_m);
  const double pupil_px2 = pi / 4 * std::pow(aperture.focal_length_m / 2 / pitch_m, 2);
  int beyond = 0;
  for (int y = 1; y < 400; y += 7) {
    for (int x = 1; x < 400; x += 7) {
      const auto ray = [&](double u, double v) { return lens.ray({x + u, y + v})->direction; };
      const glm::dvec3 a = ray(-.5, -.5), b = ray(.5, -.5), c = ray(.5, .5), d = ray(-.5, .5);
      const double cos = std::max(ray(0, 0).z, 0.0);
      const double sr = triangle_sr(a, b, c) + triangle_sr(a, c, d);
      // Across a pixel, 1/118 rad wide, the solid angle changes by its curvature: less than 1/24 of
      // 118^-2 times a small factor.
      constexpr double curvature = 2e-5;
      EXPECT_NEAR(turning.at(x, y)[0], pupil_px2 * sr, curvature * pupil_px2 * sr);
      EXPECT_NEAR(flat.at(x, y)[0], pupil_px2 * sr * cos, curvature * pupil_px2 * sr);
      testing::record_margin("fisheye", turning.at(x, y)[0] / (pupil_px2 * sr) - 1, curvature);
      beyond += cos == 0;
    }
  }
  EXPECT_GT(beyond, 20);
}

// All directions are 4 pi sr; weighted with the cosine, the front hemisphere is pi.
TEST(Irradiance, SolidAnglesSumToTheSphere) {
  const glm::ivec2 size_px(120, 60);
  const Lens lens(Equirectangular{size_px}, size_px);
  ApertureSpec aperture = f_over(4, 120 / (2 * pi));
  const double pupil_px2 = pi / 4 * std::pow(aperture.focal_length_m / 4 / pitch_m, 2);
  const auto sum = [&](ApertureSpec::Pupil pupil) {
    aperture.pupil = pupil;
    const ImageF image = pupil_sr(lens, aperture, pitch_m);
    double sr = 0;
    for (const float value : image.values()) sr += value / pupil_px2;
    return sr;
  };
  const double step_rad = pi / 60;  // midpoint sums err by step^2 / 24 per angle
  EXPECT_NEAR(sum(Turning), 4 * pi, 4 * pi * step_rad * step_rad / 24 * 1.01);
  EXPECT_NEAR(sum(Flat), pi, pi * step_rad * step_rad / 6);
}

TEST(Irradiance, IsReducedByVignetting) {
  ApertureSpec aperture = f_over(4, 500);
  const ImageF open = pupil_sr(pinhole(500), aperture, pitch_m);
  aperture.vignetting = {-0.3, 0.1, -0.05};
  const ImageF dim = pupil_sr(pinhole(500), aperture, pitch_m);
  const double r2 =
      (40 * 40 + 30 * 30) / ((81 * 81 + 61 * 61) / 4.0);  // at the centre of the corner pixel
  const double rim = 1 - 0.3 * r2 + 0.1 * r2 * r2 - 0.05 * r2 * r2 * r2;
  EXPECT_NEAR(dim.at(0, 0)[0] / open.at(0, 0)[0], rim, 1e-6);
  EXPECT_NEAR(dim.at(80, 60)[0] / open.at(80, 60)[0], rim, 1e-6);
  EXPECT_EQ(dim.at(40, 30)[0], open.at(40, 30)[0]);
}

TEST(Irradiance, IsZeroForPixelsWithoutARay) {
  const glm::ivec2 size_px(201, 201);
  // The lens folds at r = 1 / sqrt(0.9), imaged 70 px from the centre.
  const Lens lens(BrownConrady{{glm::dvec2(100), glm::dvec2(100)}, {-0.3}}, size_px);
  const ImageF sr = pupil_sr(lens, f_over(4, 100), pitch_m);
  EXPECT_EQ(sr.at(0, 0)[0], 0);
  EXPECT_EQ(sr.at(100, 20)[0], 0);
  EXPECT_GT(sr.at(100, 40)[0], 0);
}

TEST(Irradiance, IsTheSameOnAnyNumberOfThreads) {
  const glm::ivec2 size_px(201, 160);
  const Lens lens(KannalaBrandt{{glm::dvec2(70), glm::dvec2(100, 80)}, {0.02, -0.004, 0.001, 0}},
                  size_px);
  const auto values = [&](int threads) {
    ImageF sr;
    tbb::task_arena(threads).execute([&] { sr = pupil_sr(lens, f_over(4, 70), pitch_m); });
    return std::vector(sr.values().begin(), sr.values().end());
  };
  const auto one = values(1);
  EXPECT_EQ(values(2), one);
  EXPECT_EQ(values(5), one);
}

TEST(Irradiance, ErrorListsEveryFault) {
  const auto with = [](ApertureSpec aperture, double pitch = pitch_m) {
    return [aperture, pitch] { pupil_sr(pinhole(500), aperture, pitch); };
  };
  ApertureSpec aperture = f_over(4, 500);
  EXPECT_THAT(with({.focal_length_m = 0, .f_number = -1}),
              ThrowsMessage<Error>(::testing::AllOf(HasSubstr("focal_length_m = 0 must be"),
                                                    HasSubstr("f_number = -1 must be"))));
  aperture.transmission = 1.1;
  EXPECT_THAT(with(aperture), ThrowsMessage<Error>(HasSubstr("transmission = 1.1 must be")));
  aperture = f_over(4, 500);
  aperture.focal_length_m = 1.5;
  EXPECT_THAT(with(aperture),
              ThrowsMessage<Error>(HasSubstr("which has 0.0015 m with pixels of 3e-06 m: is it in "
                                             "millimetres")));
  aperture = f_over(4, 500);
  EXPECT_THAT(with(aperture, 2 * pitch_m), ThrowsMessage<Error>(HasSubstr("pixels binned")));
  aperture.vignetting = {-1.1, 0, 0};
  EXPECT_THAT(with(aperture), ThrowsMessage<Error>(HasSubstr("negative at the pixel (0, 0)")));
  EXPECT_THAT([] { irradiance(ImageF(2, 2, 3), ImageF(2, 3, 1)); },
              ThrowsMessage<Error>(HasSubstr("2 x 2 px of radiance do not fit 2 x 3 px")));
}

}  // namespace
}  // namespace groundray::irradiance_test
