#include "reconstruction/stereo/disparity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "core/error.h"
#include "reconstruction/stereo/semi_global.h"
#include "reconstruction/stereo/stereo_points.h"
#include "test/support/margin.h"
#include "test/support/wave_texture.h"

namespace groundray::disparity_test {
namespace {

using testing::add_noise;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using testing::WaveTexture;

constexpr glm::ivec2 size_px{200, 120};
constexpr float nothing = std::numeric_limits<float>::quiet_NaN();

RectifiedImage seen_whole(ImageF grey) {
  Image8 seen(grey.width(), grey.height(), 1);
  std::ranges::fill(seen.values(), std::uint8_t{1});
  return {std::move(grey), std::move(seen)};
}

struct Pair {
  RectifiedImage left, right;
};

// Plane of disparities: at_px in the centre of the left image.
struct Slant {
  double at_px = 0, by_x = 0, by_y = 0;
  double of(glm::dvec2 left) const {
    return at_px + by_x * (left.x - size_px.x / 2.0) + by_y * (left.y - size_px.y / 2.0);
  }
  // Left position of the point that a right pixel shows: u_right = u_left - of(left).
  glm::dvec2 left_of(glm::dvec2 right) const {
    const double x =
        (right.x + at_px - by_x * size_px.x / 2.0 + by_y * (right.y - size_px.y / 2.0)) /
        (1 - by_x);
    return {x, right.y};
  }
};

Pair pair_of(const Slant& slant, double noise = 0, double gain = 1, double offset = 0) {
  const WaveTexture texture(3.5);
  ImageF left = texture.image(size_px, [](glm::dvec2 place) { return place; });
  ImageF right = texture.image(size_px, [&](glm::dvec2 place) { return slant.left_of(place); });
  for (float& value : right.values()) value = static_cast<float>(gain * value + offset);
  add_noise(left, noise, {1});
  add_noise(right, noise, {2});
  return {seen_whole(std::move(left)), seen_whole(std::move(right))};
}

struct Errors {
  int count = 0, gross = 0;
  double mean_px = 0, rms_px = 0, normalised = 0;
};

Errors errors_of(const DisparityMap& map, const Slant& slant) {
  Errors errors;
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = 0; x < size_px.x; ++x) {
      const double found = map.disparity_px.at(x, y)[0];
      if (std::isnan(found)) continue;
      const double off = found - slant.of({x, y});
      ++errors.count;
      if (std::abs(off) > 1) {
        ++errors.gross;
        continue;
      }
      errors.mean_px += off;
      errors.rms_px += off * off;
      errors.normalised += std::pow(off / static_cast<double>(map.sd_px.at(x, y)[0]), 2);
    }
  }
  const double fine = std::max(1, errors.count - errors.gross);
  errors.mean_px /= fine;
  errors.rms_px = std::sqrt(errors.rms_px / fine);
  errors.normalised = std::sqrt(errors.normalised / fine);
  return errors;
}

// For the shortest wave, 3.5 px, with w = 2 pi / 3.5 per pixel, a spline through the pixels keeps H
// = sinc(w / 2)^4 / ((2 + cos w) / 3) = 0.971 and adds its alias, H (w / (2 pi - w))^4 = 0.025. So
// halfway between pixels its values differ from the wave's by 0.054; divided by its slope, w, this
// is 0.03 px. Longer waves have smaller errors.
constexpr double spline_px = 0.03;

// Noise-free images, for any fraction of the disparity.
TEST(Disparity, IsExactToAFewHundredthsOfAPixel) {
  for (const Slant& slant : {Slant{12.0, 0, 0}, Slant{12.25, 0, 0}, Slant{12.5, 0, 0},
                             Slant{15, 0.05, 0.1}, Slant{15, -0.08, 0.12}}) {
    const Pair pair = pair_of(slant);
    const Errors errors = errors_of(match(pair.left, pair.right, {.range = {{0, 47}}}), slant);
    EXPECT_GT(errors.count, 0.8 * size_px.x * size_px.y) << slant.at_px;
    EXPECT_LE(errors.gross, errors.count / 1000) << slant.at_px << " " << slant.by_x;
    EXPECT_LT(errors.rms_px, spline_px) << slant.at_px << " " << slant.by_x;
    // A tenth of the bias that a pair's points state.
    EXPECT_LT(std::abs(errors.mean_px), StereoNoise{}.bias_px / 10);
    testing::record_margin("rms", errors.rms_px, spline_px, "px");
  }
}

TEST(Disparity, DoesNotDependOnBrightnessOrContrast) {
  const Slant slant{10.3, 0.02, 0.05};
  const Pair pair = pair_of(slant, 0, 0.8, 0.07);
  const Errors errors = errors_of(match(pair.left, pair.right, {.range = {{0, 31}}}), slant);
  EXPECT_GT(errors.count, 0.8 * size_px.x * size_px.y);
  EXPECT_LT(errors.rms_px, spline_px);
}

// White noise is the model of the least squares, so their own standard deviation, without factors
// or floor, must be that of the errors. Splines between pixels keep about 2/3 of the noise's
// variance, hence the lower limit.
TEST(Disparity, StatesTheEffectOfWhiteNoise) {
  for (const double noise : {0.01, 0.03}) {
    const Slant slant{14.4, 0.03, 0.06};
    const Pair pair = pair_of(slant, noise);
    const DisparityMap map =
        match(pair.left, pair.right,
              {.range = {{0, 31}}, .sd_factor = 1, .sd_bend_factor = 0, .sd_floor_px = 0});
    const Errors errors = errors_of(map, slant);
    EXPECT_GT(errors.count, 0.7 * size_px.x * size_px.y) << noise;
    EXPECT_GT(errors.normalised, 0.75) << noise;
    EXPECT_LT(errors.normalised, 1.3) << noise;
    testing::record_margin("normalised error", errors.normalised - 1, 0.3);
  }
}

// A near square hides a strip of the background from the right camera: no disparity there.
TEST(Disparity, IsMissingInOcclusions) {
  constexpr int left_edge = 90, right_edge = 130, top = 40, bottom = 80, near = 20, far = 8;
  const WaveTexture back(3.5), front(3.5, {9});
  const auto is_front = [&](double x, double y) {
    return x >= left_edge && x < right_edge && y >= top && y < bottom;
  };
  ImageF left(size_px.x, size_px.y, 1), right = left;
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = 0; x < size_px.x; ++x) {
      left.at(x, y)[0] = static_cast<float>((is_front(x, y) ? front : back).at({x, y}));
      right.at(x, y)[0] = static_cast<float>(is_front(x + near, y) ? front.at({x + near, y})
                                                                   : back.at({x + far, y}));
    }
  }
  const DisparityMap map = match(seen_whole(left), seen_whole(right), {.range = {{0, 31}}});
  int hidden = 0, wrong = 0, found = 0;
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = far; x < size_px.x; ++x) {
      const float disparity_px = map.disparity_px.at(x, y)[0];
      // Just left of the square: the square's right image covers these points.
      if (y >= top && y < bottom && x >= left_edge - (near - far) && x < left_edge) {
        hidden += std::isnan(disparity_px) ? 0 : 1;
        continue;
      }
      if (std::isnan(disparity_px)) continue;
      ++found;
      if (std::abs(disparity_px - (is_front(x, y) ? near : far)) > 1) ++wrong;
    }
  }
  EXPECT_LT(hidden, 0.2 * (near - far) * (bottom - top));
  const int visible = (size_px.x - far) * size_px.y - (near - far) * (bottom - top);
  EXPECT_GT(found, 0.8 * visible);
  // Were the square widened by half a block, 1 px, along its 160 px of edges, this would be 160.
  EXPECT_LT(wrong, 60);
  EXPECT_GT(map.unmatched.inconsistent, 0U);
}

TEST(Disparity, EstimatesItsRange) {
  for (const double at_px : {3.0, 40.0, 70.0}) {
    const Slant slant{at_px, 0, 0.05};
    const Pair pair = pair_of(slant);
    const DisparityMap map = match(pair.left, pair.right);
    EXPECT_LE(map.range.least_px, at_px - 3);
    EXPECT_GE(map.range.most_px, at_px + 3);
    // Of the 6 px of the slant, those of the search: one in five.
    EXPECT_LT(map.range.most_px - map.range.least_px, 40);
    const Errors errors = errors_of(map, slant);
    EXPECT_GT(errors.count, 0.9 * (size_px.x - at_px - 20) * size_px.y);
    EXPECT_LT(errors.rms_px, spline_px);
  }
}

// Disparities are stored in 16 bits, times 16: those beyond 2000 px are not searched.
TEST(Disparity, StaysWithinTheRangeOf16Bits) {
  const WaveTexture texture(8);
  const glm::ivec2 wide_px(4400, 98);
  const RectifiedImage left =
      seen_whole(texture.image(wide_px, [](glm::dvec2 place) { return place; }));
  for (const double at_px : {1985.0, 2070.0}) {
    const RectifiedImage right = seen_whole(
        texture.image(wide_px, [&](glm::dvec2 place) { return place + glm::dvec2(at_px, 0); }));
    const DisparityMap map = match(left, right, {.paths = MatchOptions::Paths::Five});
    EXPECT_LE(map.range.most_px, 2000);
    int found = 0;
    for (const float disparity_px : map.disparity_px.values()) {
      if (std::isnan(disparity_px)) continue;
      ++found;
      ASSERT_NEAR(disparity_px, at_px, 1);
    }
    if (at_px > 2000) {
      EXPECT_EQ(found, 0);
    } else {
      EXPECT_GT(found, 0.8 * (wide_px.x - at_px) * wide_px.y);
    }
  }
}

TEST(Disparity, IsMissingWithoutTexture) {
  ImageF grey(size_px.x, size_px.y, 1);
  for (const float value : {0.0F, 0.5F, 1.0F}) {
    std::ranges::fill(grey.values(), value);
    for (const auto& range :
         {std::optional<DisparityRange>{}, std::optional<DisparityRange>{{0, 31}}}) {
      const DisparityMap map = match(seen_whole(grey), seen_whole(grey), {.range = range});
      EXPECT_TRUE(
          std::ranges::all_of(map.disparity_px.values(), [](float d) { return std::isnan(d); }));
    }
  }
  // No disparity either where the texture is constant along rows.
  const WaveTexture texture(3.5);
  const ImageF stripes =
      texture.image(size_px, [](glm::dvec2 place) { return glm::dvec2(0, place.y); });
  const DisparityMap map = match(seen_whole(stripes), seen_whole(stripes), {.range = {{0, 31}}});
  EXPECT_TRUE(
      std::ranges::all_of(map.disparity_px.values(), [](float d) { return std::isnan(d); }));
}

// Two unrelated images.
TEST(Disparity, IsRareBetweenUnrelatedImages) {
  const RectifiedImage left =
      seen_whole(WaveTexture(3.5).image(size_px, [](glm::dvec2 p) { return p; }));
  const RectifiedImage right =
      seen_whole(WaveTexture(3.5, {77}).image(size_px, [](glm::dvec2 p) { return p; }));
  const DisparityMap map = match(left, right, {.range = {{0, 31}}});
  const auto sure =
      std::ranges::count_if(map.confidence.values(), [](float c) { return c > 0.5F; });
  EXPECT_LT(sure, 0.02 * size_px.x * size_px.y);
}

TEST(Disparity, CountsUnmatchedPixelsByReason) {
  Pair pair = pair_of({12, 0, 0});
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = 0; x < 30; ++x) pair.left.seen.at(x, y)[0] = 0;
    for (int x = 150; x < size_px.x; ++x) pair.right.grey.at(x, y)[0] = nothing;
  }
  const DisparityMap map = match(pair.left, pair.right, {.range = {{0, 31}}});
  const auto given =
      std::ranges::count_if(map.disparity_px.values(), [](float d) { return !std::isnan(d); });
  const UnmatchedCounts& none = map.unmatched;
  EXPECT_EQ(none.unseen, 30U * size_px.y);
  EXPECT_EQ(none.unseen + none.ambiguous + none.inconsistent + none.speckle + none.unrefined +
                none.uncertain + static_cast<std::uint64_t>(given),
            static_cast<std::uint64_t>(size_px.x * size_px.y));
  for (int y = 0; y < size_px.y; ++y) {
    EXPECT_TRUE(std::isnan(map.disparity_px.at(29, y)[0]));
    EXPECT_TRUE(std::isnan(map.disparity_px.at(170, y)[0]));  // outside the right image
  }
}

// With a limit that no disparity meets, all that had one are uncertain; the others stay as they
// are.
TEST(Disparity, CountsUncertainPixelsByTheirLimit) {
  const Pair pair = pair_of({12, 0, 0});
  const DisparityMap usual = match(pair.left, pair.right, {.range = {{0, 31}}});
  const DisparityMap strict =
      match(pair.left, pair.right, {.range = {{0, 31}}, .most_sd_px = 0.05});  // of a floor of 0.1
  const auto given =
      std::ranges::count_if(usual.disparity_px.values(), [](float d) { return !std::isnan(d); });
  EXPECT_GT(given, 1000);
  EXPECT_EQ(strict.unmatched.unrefined, usual.unmatched.unrefined);
  EXPECT_EQ(strict.unmatched.uncertain,
            usual.unmatched.uncertain + static_cast<std::uint64_t>(given));
}

// The range must be estimated, and there is none.
TEST(Disparity, CountsUnmatchedPixelsWithoutARange) {
  RectifiedImage blank = seen_whole(ImageF(size_px.x, size_px.y, 1));
  for (int y = 0; y < size_px.y; ++y)
    for (int x = 0; x < 30; ++x) blank.seen.at(x, y)[0] = 0;
  RectifiedImage unseen = blank;
  std::ranges::fill(unseen.seen.values(), std::uint8_t{0});
  const UnmatchedCounts none = match(blank, unseen).unmatched;
  EXPECT_EQ(none.unseen, 30U * size_px.y);
  EXPECT_EQ(none.ambiguous, (size_px.x - 30U) * size_px.y);
}

TEST(Disparity, RemovesSpecklesBelowTheGivenSize) {
  for (const int least : {0, 1, 5, 6}) {
    ImageF patch(20, 10, 1);
    std::ranges::fill(patch.values(), nothing);
    for (int x = 7; x < 12; ++x) patch.at(x, 4)[0] = 3;
    EXPECT_EQ(remove_speckles(patch, least), least > 5 ? 5U : 0U);
    EXPECT_EQ(std::isnan(patch.at(8, 4)[0]), least > 5);
  }
}

// The disparity between an image and itself is 0 px, whatever its values at the border: a spline
// with errors of some percent of full scale there would shift the windows beside it by hundredths
// of a pixel.
TEST(Disparity, IsZeroBetweenEqualImagesEvenAtTheBorder) {
  ImageF noise(30, 20, 1), start_px(30, 20, 1);
  testing::add_noise(noise, 0.2, {4});
  const RefinedDisparity refined = refine(noise, noise, start_px, 9);
  for (const float disparity_px : refined.disparity_px.values())
    EXPECT_NEAR(disparity_px, 0, 1e-6);  // rounding of the coefficients, which are floats
}

// Half the root mean square deviation of a parabola from its plane, with weights of sd 2 px that
// end 4 px from the middle: 0.61 of what the plane is off in the middle.
TEST(Disparity, StatesTheErrorOfAPlaneWhereTheSurfaceBends) {
  constexpr double bend_px = 0.02;
  ImageF noise(30, 20, 1), start_px(30, 20, 1);
  testing::add_noise(noise, 0.2, {4});
  for (int y = 0; y < start_px.height(); ++y) {
    for (int x = 0; x < start_px.width(); ++x)
      start_px.at(x, y)[0] = static_cast<float>(0.5 * bend_px * (x - 15) * (x - 15));
  }
  double weights = 0, square = 0, fourth = 0;
  for (int i = -4; i <= 4; ++i) {
    const double weight = std::exp(-0.5 * i * i / 4);
    weights += weight;
    square += weight * i * i;
    fourth += weight * std::pow(i, 4);
  }
  square /= weights;
  fourth /= weights;
  const double expected_px = 0.5 * 0.5 * bend_px * std::sqrt(fourth - square * square);
  const double off_px = 0.5 * bend_px * square;
  const float stated_px = refine(noise, noise, start_px, 9).bend_px.at(15, 10)[0];
  EXPECT_NEAR(stated_px, expected_px, 1e-6);
  EXPECT_NEAR(stated_px / off_px, 0.61, 0.01);
  std::ranges::fill(start_px.values(), 0.F);
  EXPECT_NEAR(refine(noise, noise, start_px, 9).bend_px.at(15, 10)[0], 0, 1e-6);
}

TEST(Disparity, AddsTheErrorOfBendsToTheStatedOne) {
  const Pair pair = pair_of({14.4, 0.03, 0.06}, 0.01);
  const auto stated = [&](double bend_factor) {
    return match(pair.left, pair.right,
                 {.range = {{0, 31}},
                  .sd_factor = 0,
                  .sd_bend_factor = bend_factor,
                  .sd_floor_px = 0,
                  .most_sd_px = 10})
        .sd_px;
  };
  const ImageF once = stated(1), thrice = stated(3);
  std::size_t count = 0;
  for (std::size_t i = 0; i < once.values().size(); ++i) {
    if (!(once.values()[i] > 0)) continue;  // NaN where there is no match
    EXPECT_NEAR(thrice.values()[i] / once.values()[i], 3, 1e-6);
    ++count;
  }
  EXPECT_GT(count, 0.7 * size_px.x * size_px.y);
}

std::vector<std::uint32_t> bits_of(const ImageF& image) {
  std::vector<std::uint32_t> bits;
  for (const float value : image.values()) bits.push_back(std::bit_cast<std::uint32_t>(value));
  return bits;
}

TEST(Disparity, IsTheSameForAnyNumberOfThreads) {
  const Pair pair = pair_of({14.4, 0.03, 0.06}, 0.02);
  const int threads_before = cv::getNumThreads();
  std::vector<DisparityMap> maps;
  for (const int threads : {1, 2, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(threads));
    cv::setNumThreads(threads);
    maps.push_back(match(pair.left, pair.right));
  }
  cv::setNumThreads(threads_before);
  for (const DisparityMap& map : maps) {
    EXPECT_EQ(bits_of(map.disparity_px), bits_of(maps[0].disparity_px));
    EXPECT_EQ(bits_of(map.sd_px), bits_of(maps[0].sd_px));
    EXPECT_EQ(bits_of(map.confidence), bits_of(maps[0].confidence));
  }
}

TEST(Disparity, AcceptsImagesOfAnySize) {
  const WaveTexture texture(3.5);
  for (const glm::ivec2 size : {glm::ivec2(1, 1), glm::ivec2(1, 40), glm::ivec2(40, 1),
                                glm::ivec2(3, 2), glm::ivec2(17, 9), glm::ivec2(900, 4)}) {
    const RectifiedImage image =
        seen_whole(texture.image(size, [](glm::dvec2 place) { return place; }));
    for (const auto paths : {MatchOptions::Paths::Five, MatchOptions::Paths::Eight}) {
      for (const auto& range :
           {std::optional<DisparityRange>{}, std::optional<DisparityRange>{{-5, 31}},
            std::optional<DisparityRange>{{100, 131}}}) {
        const DisparityMap map = match(image, image, {.range = range, .paths = paths});
        EXPECT_EQ(map.disparity_px.width(), size.x);
        for (const float disparity_px : map.disparity_px.values())
          EXPECT_TRUE(std::isnan(disparity_px) || std::abs(disparity_px) < 1);
      }
    }
  }
}

TEST(Disparity, RangesFollowDepths) {
  const PinholePair pair{.focal_px = 500, .size_px = size_px, .baseline_m = 0.2};
  EXPECT_EQ(disparity_range(pair, 4.1, std::numeric_limits<double>::infinity()),
            (DisparityRange{-1, 26}));
  EXPECT_EQ(disparity_range(pair, 2, 8), (DisparityRange{11, 51}));
  // 1999.6 px: the extra pixel on the near side does not exceed the limit of matching.
  EXPECT_EQ(disparity_range(pair, 100 / 1999.6, 100), (DisparityRange{0, 2000}));
  for (const auto& depths_m : {std::pair(0.0, 5.0), std::pair(3.0, 2.0), std::pair(-1.0, 2.0),
                               std::pair(0.01, 2.0), std::pair(1.0, std::nan(""))})
    EXPECT_THAT([&] { disparity_range(pair, depths_m.first, depths_m.second); },
                ThrowsMessage<Error>(HasSubstr("the nearest depth must be")));
}

TEST(Disparity, RejectsInvalidImagesAndOptions) {
  const Pair pair = pair_of({12, 0, 0});
  const auto expect_refused = [&](const MatchOptions& options, const char* part) {
    EXPECT_THAT([&] { match(pair.left, pair.right, options); },
                ThrowsMessage<Error>(HasSubstr(part)));
  };
  expect_refused({.block_px = 4}, "block_px = 4 must be odd");
  expect_refused({.window_px = 3}, "window_px = 3");
  expect_refused({.step_cost = 40}, "below jump_cost = 32");
  expect_refused({.uniqueness_percent = 100}, "uniqueness_percent = 100");
  expect_refused({.left_right_px = -1}, "left_right_px = -1");
  expect_refused({.speckle_px = -1}, "speckle_px = -1");
  expect_refused({.sd_factor = -1}, "sd_factor = -1");
  expect_refused({.sd_bend_factor = 101}, "sd_bend_factor = 101");
  expect_refused({.most_sd_px = 0}, "most_sd_px = 0");
  expect_refused({.range = {{5, 5}}}, "range = 5 to 5 px");
  expect_refused({.range = {{0, 5000}}}, "range = 0 to 5000 px");
  expect_refused({.range = {{0, 31}}, .most_bytes = 1000}, "use paths Five");
  expect_refused({.most_bytes = 1000}, "use a narrower range");
  const RectifiedImage small = seen_whole(ImageF(199, 120, 1));
  EXPECT_THAT([&] { match(pair.left, small); },
              ThrowsMessage<Error>(HasSubstr("the right one 199 x 120")));
  EXPECT_THAT([] { match({}, {}); }, ThrowsMessage<Error>(HasSubstr("must have pixels")));
}

}  // namespace
}  // namespace groundray::disparity_test
