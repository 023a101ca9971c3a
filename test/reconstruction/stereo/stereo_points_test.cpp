#include "reconstruction/stereo/stereo_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "core/error.h"
#include "core/random.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"
#include "test/support/scans/stereo_views.h"

namespace groundray::stereo_points_test {
namespace {

using testing::centred;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using testing::turned;
using testing::view_of;

constexpr glm::ivec2 size_px{96, 64};
constexpr float nothing = std::numeric_limits<float>::quiet_NaN();

StereoView camera(double x_m) {
  const Pose X_DL{turned({100, 20, 5}), {700, -20, 12}};
  return view_of(BrownConrady{centred(80, size_px), {-0.1, 0.01, 0.001, 0}}, size_px,
                 X_DL * Pose{{1, 0, 0, 0}, {x_m, 0, 0}});
}

DisparityMap map_of(const PinholePair& pair, float disparity_px) {
  const ImageF empty(pair.size_px.x, pair.size_px.y, 1);
  DisparityMap map{empty, {}, empty, {}, {}};
  std::ranges::fill(map.disparity_px.values(), disparity_px);
  std::ranges::fill(map.confidence.values(), 1.0F);
  return map;
}

// Points of a landscape are entered into the map where both cameras see them; the results must be
// these points, and their positions in the left camera's own image.
TEST(StereoPoints, MatchThePointsSeenByBothCameras) {
  const StereoView left = camera(0), right = camera(0.4);
  const PinholePair pair = pinhole_pair(left, right);
  DisparityMap map = map_of(pair, nothing);
  std::vector<glm::dvec3> truth;
  for (int y = 3; y < pair.size_px.y; y += 6) {
    for (int x = 3; x < pair.size_px.x; x += 6) {
      const double depth_m = 2 + 0.01 * x + 0.03 * y;
      const glm::dvec3 p_LQ(depth_m * (glm::dvec2(x, y) - pair.centre_px) / pair.focal_px, depth_m);
      truth.push_back(pair.X_DL * p_LQ);
      // Projection of the point into the right pinhole.
      const glm::dvec3 p_RQ = inverse(pair.X_DR) * truth.back();
      const double u_right = pair.focal_px * p_RQ.x / p_RQ.z + pair.centre_px.x;
      map.disparity_px.at(x, y)[0] = static_cast<float>(x - u_right);
    }
  }
  const StereoPoints points = stereo_points(pair, left, map, {.most_relative_sd = 1});
  ASSERT_EQ(points.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT(glm::distance(points.p_m[i], truth[i]), 2e-6);  // disparities are floats
    const auto pixel = left.project(inverse(left.X_DC) * truth[i]);
    ASSERT_TRUE(pixel.has_value());
    EXPECT_LT(glm::distance(*pixel, glm::dvec2(points.pixels[i])), 1e-4);
    EXPECT_NEAR(points.depth_m[i], (inverse(pair.X_DL) * truth[i]).z, 1e-5);
  }
}

// Formula of Matthies and Shafer: the sd of depth is Z^2 / (f B) times that of the disparity.
TEST(StereoPoints, DepthSdGrowsWithTheSquareOfDepth) {
  const StereoView left = camera(0);
  const PinholePair pair = pinhole_pair(left, camera(0.4));
  const DisparityMap map = map_of(pair, 5);
  const StereoPoints points = stereo_points(pair, left, map);
  ASSERT_GT(points.size(), 20U);
  const double per_px_m = std::pow(points.depth_m[0], 2) / (pair.focal_px * pair.baseline_m);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(points.depth_sd_m[i], per_px_m * usual_match_px, 1e-5);
    const glm::dvec3 ahead = pair.X_DL.rotation * glm::dvec3(0, 0, 1);
    EXPECT_NEAR(glm::dot(glm::dvec3(points.bias_m[i]), ahead), -per_px_m * 0.1, 1e-5);
    // A bias moves a point along its line of sight.
    const glm::dvec3 sight = glm::normalize(points.p_m[i] - pair.X_DL.translation_m);
    EXPECT_LT(glm::length(glm::cross(sight, glm::dvec3(points.bias_m[i]))), 1e-6);
  }
}

// Draws pixels and disparities, makes points of them, and compares their spread with the stated
// covariance: the limit of 1 % covers second-order terms of 3e-4 and the sample's own scatter.
TEST(StereoPoints, CovarianceMatchesDrawnPoints) {
  const PinholePair pair{
      .focal_px = 500, .centre_px = {310, 240}, .size_px = {640, 480}, .baseline_m = 0.3};
  constexpr int draws = 200000;
  constexpr double disparity_px = 30, match_px = 0.3, place_px = 0.4;
  const glm::dvec2 pixel(500, 100);
  const StereoPoint point = stereo_point(pair, pixel, disparity_px, match_px, place_px);
  glm::dvec3 mean(0);
  glm::dmat3 square(0);
  for (std::uint32_t i = 0; i < draws; ++i) {
    const glm::dvec2 place = random_normal({.seed = {3}, .pulse = i});
    const double match = random_normal({.seed = {3}, .sensor = 1, .pulse = i}).x;
    const glm::dvec3 off =
        stereo_point(pair, pixel + place_px * place, disparity_px + match_px * match, 0, 0).p_m -
        point.p_m;
    mean += off;
    square += glm::outerProduct(off, off);
  }
  mean /= draws;
  const glm::dmat3 spread = square / double{draws} - glm::outerProduct(mean, mean);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double scale = std::sqrt(point.covariance_m2[i][i] * point.covariance_m2[j][j]);
      const double off = (spread[i][j] - point.covariance_m2[i][j]) / scale;
      EXPECT_NEAR(off, 0, 0.015) << i << ", " << j;  // 4 sd of a sample's: sqrt(2 / 200000) each
      testing::record_margin("covariance", off, 0.015);
    }
  }
  // Derivative by finite differences.
  constexpr double step = 1e-4;
  const glm::dvec3 slope = (stereo_point(pair, pixel, disparity_px + step, 0, 0).p_m -
                            stereo_point(pair, pixel, disparity_px - step, 0, 0).p_m) /
                           (2 * step);
  EXPECT_LT(glm::distance(slope, point.by_disparity_m), 1e-8);
}

TEST(StereoPoints, CovarianceIsRotatedToD) {
  const StereoView left = camera(0);
  const PinholePair pair = pinhole_pair(left, camera(0.4));
  const StereoPoints points = stereo_points(pair, left, map_of(pair, 5));
  const std::size_t i = points.size() / 2;
  const glm::dvec3 up = glm::conjugate(pair.X_DL.rotation) * glm::dvec3(0, 0, 1);
  const glm::dvec3 p_LQ = inverse(pair.X_DL) * points.p_m[i];
  const StereoPoint point = stereo_point(
      pair, glm::dvec2(p_LQ) / p_LQ.z * pair.focal_px + pair.centre_px, 5, usual_match_px, 0.3);
  const double alone_m2 = glm::dot(up, point.covariance_m2 * up);
  EXPECT_NEAR(points.covariance_m2[i][2][2], alone_m2, 1e-5 * alone_m2);
  // Four neighbours 6 px apart, with errors correlated by exp(-distance / 6 px).
  EXPECT_NEAR(points.together, 1 + 2 * std::exp(-1.0) + std::exp(-std::sqrt(2.0)), 1e-12);
  const double variance_m2 = points.together * alone_m2;
  MeasuredPoints measured;
  append(points, 7, measured);
  append(points, 8, measured);
  ASSERT_EQ(measured.size(), 2 * points.size());
  EXPECT_NEAR(measured.sd_m[i], std::sqrt(variance_m2), 1e-5 * std::sqrt(variance_m2));
  EXPECT_NEAR(measured.bias_sd_m[i], std::abs(glm::dot(up, point.by_disparity_m) * 0.1), 1e-6);
  // Distances from planes of slope g have the variance n' C n with n = (-g, 1), for any slope; the
  // remaining position error counts as the mean over both directions, so slopes in two directions
  // at right angles are added.
  const double footprint_m = p_LQ.z / pair.focal_px;
  for (const glm::dvec2 slope : {glm::dvec2(0.5, -0.2), {0.1, 0.9}, {-0.3, -0.3}}) {
    double told_m2 = 0, true_m2 = 0;
    for (const glm::dvec2 g : {slope, glm::dvec2(-slope.y, slope.x)}) {
      const glm::dvec3 n = glm::conjugate(pair.X_DL.rotation) * glm::dvec3(-g, 1);
      true_m2 += points.together * glm::dot(n, point.covariance_m2 * n) +
                 glm::dot(g, g) * footprint_m * footprint_m / 12;
      told_m2 += std::pow(measured.sd_m[i] * (1 - glm::dot(g, glm::dvec2(measured.lean[i]))), 2) +
                 glm::dot(g, g) * std::pow(measured.across_sd_m[i], 2);
    }
    EXPECT_NEAR(told_m2, true_m2, 1e-5 * true_m2);
  }
  EXPECT_EQ(measured.groups[i], 7U);
  EXPECT_EQ(measured.groups.back(), 8U);
  EXPECT_EQ(measured.origins[i], PointOrigin::Stereo);
}

TEST(StereoPoints, ExcludesUncertainAndOutOfLimitPoints) {
  const StereoView left = camera(0);
  const PinholePair pair = pinhole_pair(left, camera(0.4));
  DisparityMap map = map_of(pair, 5);
  const auto all =
      static_cast<std::uint64_t>(pair.size_px.x) * static_cast<std::uint64_t>(pair.size_px.y);
  const StereoPoints points = stereo_points(pair, left, map, {.stride_px = 1});
  EXPECT_EQ(points.size() + points.out_of_limits, all);  // out of limits: not imaged by the lens
  EXPECT_EQ(points.too_uncertain, 0U);
  // 0.3 and 0.1 px are 6.3 % of 5.
  EXPECT_EQ(
      stereo_points(pair, left, map, {.most_relative_sd = 0.06, .stride_px = 1}).too_uncertain,
      all);
  const double depth_m = pair.focal_px * pair.baseline_m / 5;
  EXPECT_EQ(stereo_points(pair, left, map, {.farthest_m = 0.99 * depth_m}).size(), 0U);
  EXPECT_EQ(stereo_points(pair, left, map, {.nearest_m = 1.01 * depth_m}).size(), 0U);
  std::ranges::fill(map.confidence.values(), 0.4F);
  EXPECT_EQ(stereo_points(pair, left, map).size(), 0U);
  for (const float none : {0.0F, -3.0F, nothing, std::numeric_limits<float>::infinity()})
    EXPECT_EQ(stereo_points(pair, left, map_of(pair, none)).size(), 0U) << none;
  // Even without noise, points at infinity are omitted.
  EXPECT_EQ(
      stereo_points(pair, left, map_of(pair, 0), {.noise = {.match_px = 0, .bias_px = 0}}).size(),
      0U);
}

TEST(StereoPoints, UsesTheSdOfTheMapUnlessGiven) {
  const StereoView left = camera(0);
  const PinholePair pair = pinhole_pair(left, camera(0.4));
  DisparityMap map = map_of(pair, 5);
  map.sd_px = ImageF(pair.size_px.x, pair.size_px.y, 1);
  std::ranges::fill(map.sd_px.values(), 0.05F);
  const double per_px_m =
      std::pow(pair.focal_px * pair.baseline_m / 5, 2) / (pair.focal_px * pair.baseline_m);
  EXPECT_NEAR(stereo_points(pair, left, map).depth_sd_m[0], 0.05 * per_px_m, 1e-5);
  EXPECT_NEAR(stereo_points(pair, left, map, {.noise = {.match_px = 0.2}}).depth_sd_m[0],
              0.2 * per_px_m, 1e-5);
}

TEST(StereoPoints, RejectsInvalidInput) {
  const StereoView left = camera(0);
  const PinholePair pair = pinhole_pair(left, camera(0.4));
  const DisparityMap map = map_of(pair, 5);
  const auto expect_refused = [&](const StereoPointOptions& options, const char* part) {
    EXPECT_THAT([&] { stereo_points(pair, left, map, options); },
                ThrowsMessage<Error>(HasSubstr(part)));
  };
  expect_refused({.noise = {.match_px = -1}}, "match_px = -1");
  expect_refused({.noise = {.bias_px = nothing}}, "bias_px = nan");
  expect_refused({.noise = {.place_px = -0.1}}, "place_px");
  expect_refused({.nearest_m = 5, .farthest_m = 4}, "are they swapped?");
  expect_refused({.most_relative_sd = 0}, "most_relative_sd");
  expect_refused({.stride_px = 0}, "stride_px = 0");
  EXPECT_THAT([&] { stereo_points({}, left, map); },
              ThrowsMessage<Error>(HasSubstr("focal length of 0")));
  EXPECT_THAT([&] { stereo_points(pair, left, {}); },
              ThrowsMessage<Error>(HasSubstr("the disparities have 0 x 0 px")));
}

}  // namespace
}  // namespace groundray::stereo_points_test
