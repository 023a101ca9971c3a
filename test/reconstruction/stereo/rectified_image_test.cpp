#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "reconstruction/stereo/pinhole_pair.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"
#include "test/support/scans/stereo_views.h"
#include "test/support/wave_texture.h"

namespace groundray::rectified_image_test {
namespace {

using testing::centred;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using testing::turned;
using testing::view_of;
using testing::WaveTexture;

constexpr glm::ivec2 size_px{200, 150};

StereoView fisheye(double x_m, const glm::dvec3& turn_deg) {
  return view_of(KannalaBrandt{centred(90, size_px), {-0.01, 0.002, 0, 0}}, size_px,
                 {turned(turn_deg), {x_m, 0, 0}});
}

// The texture is known between pixels, so the expected value of each resampled pixel needs no
// image.
TEST(RectifiedImage, ResamplesAtTheExactPositions) {
  const StereoView left = fisheye(0, {2, 3, -2}), right = fisheye(0.2, {-1, -2, 4});
  const PinholePair pair = pinhole_pair(left, right);
  const WaveTexture texture(4);
  const ImageF image = texture.image(size_px, [](glm::dvec2 place) { return place; });
  // Three lobes reproduce waves of 4 px within 2 % of their amplitude, 0.04 each; ten waves are
  // nearly as short.
  constexpr double tolerance = 0.008;
  const RectifiedImage result = resample(image, pair, StereoSide::Left, left);
  int seen = 0;
  for (int y = 0; y < pair.size_px.y; ++y) {
    for (int x = 0; x < pair.size_px.x; ++x) {
      const auto place = source_px(pair, StereoSide::Left, left, {x, y});
      const bool is_inside = place && place->x >= 0 && place->y >= 0 && place->x <= size_px.x - 1 &&
                             place->y <= size_px.y - 1;
      ASSERT_EQ(result.seen.at(x, y)[0] != 0, is_inside);
      if (!is_inside) {
        EXPECT_EQ(result.grey.at(x, y)[0], 0);
        continue;
      }
      if (place->x < 3 || place->y < 3 || place->x > size_px.x - 4 || place->y > size_px.y - 4)
        continue;
      ++seen;
      const double off = static_cast<double>(result.grey.at(x, y)[0]) - texture.at(*place);
      ASSERT_LT(std::abs(off), tolerance);
      testing::record_margin("grey", off, tolerance);
    }
  }
  EXPECT_GT(seen, 10000);
}

TEST(RectifiedImage, KeepsTheImageOfARectifiedPair) {
  const auto view = [](double x_m) {
    return view_of(Pinhole{centred(180, size_px)}, size_px, {{1, 0, 0, 0}, {x_m, 0, 0}});
  };
  const ImageF image = WaveTexture(3).image(size_px, [](glm::dvec2 place) { return place; });
  const PinholePair pair = pinhole_pair(view(0), view(0.1));
  ASSERT_EQ(pair.size_px, size_px);
  const RectifiedImage result = resample(image, pair, StereoSide::Right, view(0.1));
  for (std::size_t i = 0; i < image.values().size(); ++i) {
    // Positions have errors of 1e-8 px, and slopes are at most 1/px.
    ASSERT_NEAR(result.grey.values()[i], image.values()[i], 1e-6F);
    ASSERT_EQ(result.seen.values()[i], 1);
  }
}

// Waves that the coarser camera cannot resolve vanish instead of aliasing.
TEST(RectifiedImage, AveragesTheImageOfAFinerCamera) {
  const auto view = [](double focal_px, double x_m) {
    return view_of(Pinhole{centred(focal_px, size_px)}, size_px, {{1, 0, 0, 0}, {x_m, 0, 0}});
  };
  const StereoView fine = view(400, 0), coarse = view(80, 0.1);
  const PinholePair pair = pinhole_pair(fine, coarse);  // 240 px
  ImageF stripes(size_px.x, size_px.y, 1);
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = 0; x < size_px.x; ++x)
      stripes.at(x, y)[0] =
          static_cast<float>(0.5 + 0.5 * std::cos(2 * x * std::numbers::pi / 2.5));
  }
  const RectifiedImage result = resample(stripes, pair, StereoSide::Left, fine);
  for (int y = 5; y < pair.size_px.y - 5; ++y) {
    for (int x = 0; x < pair.size_px.x; ++x) {
      const auto place = source_px(pair, StereoSide::Left, fine, {x, y});
      if (place && place->x > 8 && place->x < size_px.x - 9 && place->y > 0 &&
          place->y < size_px.y - 1) {
        ASSERT_NEAR(result.grey.at(x, y)[0], 0.5, 0.05);
      }
    }
  }
}

TEST(RectifiedImage, ExcludesNanPixels) {
  const auto view = [](double x_m) {
    return view_of(Pinhole{centred(180, size_px)}, size_px, {{1, 0, 0, 0}, {x_m, 0, 0}});
  };
  ImageF image(size_px.x, size_px.y, 1);
  std::ranges::fill(image.values(), 0.25F);
  image.at(50, 60)[0] = std::numeric_limits<float>::quiet_NaN();
  const PinholePair pair = pinhole_pair(view(0), view(0.1));
  const RectifiedImage result = resample(image, pair, StereoSide::Left, view(0));
  EXPECT_EQ(result.seen.at(50, 60)[0], 0);
  EXPECT_EQ(result.grey.at(50, 60)[0], 0);
  EXPECT_EQ(result.seen.at(56, 60)[0], 1);
  EXPECT_FLOAT_EQ(result.grey.at(56, 60)[0], 0.25F);
}

TEST(RectifiedImage, RejectsImagesOfAnotherSize) {
  const StereoView left = fisheye(0, {0, 0, 0}), right = fisheye(0.2, {0, 0, 0});
  const PinholePair pair = pinhole_pair(left, right);
  for (const ImageF& image : {ImageF(), ImageF(200, 149, 1), ImageF(200, 150, 3)})
    EXPECT_THAT([&] { resample(image, pair, StereoSide::Right, right); },
                ThrowsMessage<Error>(HasSubstr("the right image has")));
}

TEST(RectifiedImage, ConvertsColourToLuminance) {
  Image8 image(1, 1, 4);
  image.values()[0] = 255;
  image.values()[1] = 51;
  image.values()[3] = 7;
  EXPECT_NEAR(grey_of(image).at(0, 0)[0], 0.2126 + 0.2 * 0.7152, 1e-6);
  Image8 grey(1, 1, 2);
  grey.values()[0] = 51;
  EXPECT_FLOAT_EQ(grey_of(grey).at(0, 0)[0], 0.2F);
  EXPECT_THAT([] { grey_of(Image8(1, 1, 5)); }, ThrowsMessage<Error>(HasSubstr("5 channels")));
  EXPECT_THAT([] { grey_of(Image8()); }, ThrowsMessage<Error>(HasSubstr("0 channels")));
}

}  // namespace
}  // namespace groundray::rectified_image_test
