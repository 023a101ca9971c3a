#include "reconstruction/stereo/pinhole_pair.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "core/error.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"
#include "test/support/scans/stereo_views.h"

namespace groundray::pinhole_pair_test {
namespace {

using ::testing::AllOf;
using testing::centred;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using testing::turned;
using testing::view_of;

constexpr glm::ivec2 size_px{640, 480};
// Arbitrary pose of a vehicle far from D's origin.
const Pose X_DB{glm::normalize(glm::dquat(0.3, -0.5, 0.4, 0.7)), {1200, -340, 87}};

LensModel brown() {
  return BrownConrady{{{457, 460}, {322, 236}, 0}, {-0.28, 0.075, 0.0002, 0.00002}};
}
LensModel fisheye() { return KannalaBrandt{centred(260, size_px), {-0.01, 0.002, 0, 0}}; }
LensModel wide() { return DoubleSphere{centred(280, size_px), -0.2, 0.55}; }

StereoView camera(const LensModel& lens, const glm::dvec3& p_BC, const glm::dvec3& turn_deg) {
  return view_of(lens, size_px, X_DB * Pose{turned(turn_deg), p_BC});
}

struct Pair {
  const char* name;
  StereoView left, right;
};

std::vector<Pair> pairs() {
  const glm::dvec3 at(0, 0, 0);
  return {
      {"like", camera(brown(), at, {1, -3, 2}), camera(brown(), {0.3, 0.02, -0.01}, {-2, 4, -1})},
      {"fisheyes", camera(fisheye(), at, {0, 3, 0}),
       camera(fisheye(), {0.2, 0.01, 0.03}, {2, -3, 5})},
      {"of two kinds", camera(brown(), at, {0, 0, 0}),
       camera(wide(), {0.25, -0.1, 0.02}, {0, -4, 9})},
      {"above another", camera(fisheye(), at, {0, 0, 1}),
       camera(brown(), {0.01, -0.4, 0.02}, {3, 0, -2})},
      {"swapped", camera(brown(), at, {0, 0, 1}), camera(wide(), {-0.3, 0.01, 0.02}, {3, 0, -2})}};
}

// Projection of a point of D into a pinhole, by definition.
glm::dvec2 pinhole_px(const PinholePair& pair, StereoSide side, const glm::dvec3& p_DQ) {
  const glm::dvec3 p_RQ = inverse(pair.X_D(side)) * p_DQ;
  return pair.focal_px * glm::dvec2(p_RQ) / p_RQ.z + pair.centre_px;
}

// Oracle: the lens projects a point into the camera's own image; the pair must give the same
// position for the pinhole's pixel that shows the point, and the rows in both pinholes must be
// equal.
TEST(PinholePair, PointsAreInEqualRowsAtTheirExactPositions) {
  constexpr double tolerance_px = 1e-6;  // directions are rounded to 1e-16 of 1.2 km
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> share(-1, 1), depth_m(0.5, 80);
  for (const Pair& views : pairs()) {
    const PinholePair pair = pinhole_pair(views.left, views.right);
    EXPECT_EQ(pair.X_DL.rotation, pair.X_DR.rotation);
    int seen = 0;
    for (int i = 0; i < 1500; ++i) {
      const double z = depth_m(random);
      const glm::dvec3 p_DQ = pair.X_DL * glm::dvec3(z * share(random), z * share(random), z);
      const glm::dvec2 left = pinhole_px(pair, StereoSide::Left, p_DQ);
      const glm::dvec2 right = pinhole_px(pair, StereoSide::Right, p_DQ);
      EXPECT_NEAR(left.y, right.y, tolerance_px) << views.name;
      EXPECT_NEAR(left.x - right.x, pair.focal_px * pair.baseline_m / z, tolerance_px);
      testing::record_margin("rows", left.y - right.y, tolerance_px, "px");
      for (const auto side : {StereoSide::Left, StereoSide::Right}) {
        const StereoView& view = side == StereoSide::Left ? views.left : views.right;
        const auto expected = view.project(inverse(view.X_DC) * p_DQ);
        const auto place = source_px(pair, side, view, side == StereoSide::Left ? left : right);
        ASSERT_EQ(expected.has_value(), place.has_value()) << views.name;
        if (!place) continue;
        ++seen;
        EXPECT_LT(glm::distance(*expected, *place), tolerance_px) << views.name;
        testing::record_margin("places", glm::distance(*expected, *place), tolerance_px, "px");
      }
    }
    EXPECT_GT(seen, 1200) << views.name;
  }
}

// The right camera is always on the right, wherever it is mounted, and neither camera is turned
// more than necessary.
TEST(PinholePair, FacesTheDirectionOfBothCameras) {
  for (const Pair& views : pairs()) {
    const PinholePair pair = pinhole_pair(views.left, views.right);
    const glm::dvec3 p_LR = inverse(pair.X_DL) * pair.X_DR.translation_m;
    EXPECT_LT(glm::distance(p_LR, glm::dvec3(pair.baseline_m, 0, 0)), 1e-12) << views.name;
    EXPECT_EQ(pair.X_DL.translation_m, views.left.X_DC.translation_m);
    EXPECT_EQ(pair.X_DR.translation_m, views.right.X_DC.translation_m);
    const glm::dvec3 ahead = pair.X_DL.rotation * glm::dvec3(0, 0, 1);
    for (const StereoView& view : {views.left, views.right})
      EXPECT_GT(glm::dot(ahead, view.X_DC.rotation * glm::dvec3(0, 0, 1)),
                std::cos(glm::radians(12.0)));
  }
}

TEST(PinholePair, KeepsARectifiedPair) {
  const LensModel lens = Pinhole{{{500, 500}, {310, 245}, 0}};
  const PinholePair pair =
      pinhole_pair(camera(lens, {0, 0, 0}, {0, 0, 0}), camera(lens, {0.12, 0, 0}, {0, 0, 0}));
  EXPECT_NEAR(pair.focal_px, 500, 1e-6);  // derived by central differences
  EXPECT_LT(glm::distance(pair.centre_px, {310, 245}), 1e-6);
  EXPECT_EQ(pair.size_px, size_px);
  EXPECT_NEAR(pair.baseline_m, 0.12, 1e-12);
  EXPECT_EQ(pair.lost_share[0], 0);
  EXPECT_EQ(pair.lost_share[1], 0);
}

cv::Matx33d matrix_of(const glm::dquat& q) {
  const glm::dmat3 m = glm::mat3_cast(q);
  return {m[0][0], m[1][0], m[2][0], m[0][1], m[1][1], m[2][1], m[0][2], m[1][2], m[2][2]};
}

cv::Matx33d matrix_of(const PixelScale& s) {
  return {s.focal_px.x, 0, s.centre_px.x, 0, s.focal_px.y, s.centre_px.y, 0, 0, 1};
}

TEST(PinholePair, RotationMatchesOpenCv) {
  const Pair views = pairs()[0];
  const PinholePair pair = pinhole_pair(views.left, views.right);
  const Pose X_RL = inverse(views.right.X_DC) * views.left.X_DC;
  const cv::Matx33d any = matrix_of(centred(500, size_px));
  cv::Matx33d left_turn, right_turn;
  cv::Matx34d left_projection, right_projection;
  cv::Matx44d to_depth;
  const glm::dvec3 t = X_RL.translation_m;
  cv::stereoRectify(any, cv::noArray(), any, cv::noArray(), {size_px.x, size_px.y},
                    matrix_of(X_RL.rotation), cv::Vec3d(t.x, t.y, t.z), left_turn, right_turn,
                    left_projection, right_projection, to_depth);
  const glm::dquat R_RD = glm::conjugate(pair.X_DL.rotation);
  const double left_off =
      cv::norm(left_turn, matrix_of(R_RD * views.left.X_DC.rotation), cv::NORM_INF);
  const double right_off =
      cv::norm(right_turn, matrix_of(R_RD * views.right.X_DC.rotation), cv::NORM_INF);
  constexpr double tolerance = 1e-12;  // half turns by Rodrigues and back, of poses at 1.2 km
  EXPECT_LT(std::max(left_off, right_off), tolerance);
  testing::record_margin("turns", std::max(left_off, right_off), tolerance);
}

void expect_places(const PinholePair& pair, const StereoView& view, const cv::Mat& x,
                   const cv::Mat& y) {
  constexpr double tolerance_px = 1e-3;  // maps are floats: 6e-5 px at 640
  for (int row = 0; row < pair.size_px.y; row += 7) {
    for (int column = 0; column < pair.size_px.x; column += 7) {
      const auto place = source_px(pair, StereoSide::Left, view, {column, row});
      if (!place || place->x < 0 || place->y < 0 || place->x > 639 || place->y > 479) continue;
      const glm::dvec2 theirs(x.at<float>(row, column), y.at<float>(row, column));
      ASSERT_LT(glm::distance(*place, theirs), tolerance_px) << column << ", " << row;
      testing::record_margin("maps", glm::distance(*place, theirs), tolerance_px, "px");
    }
  }
}

TEST(PinholePair, MapsMatchOpenCv) {
  for (const bool is_fisheye : {false, true}) {
    const Pair views = pairs()[is_fisheye ? 1 : 0];
    const PinholePair pair = pinhole_pair(views.left, views.right);
    const cv::Matx33d turn =
        matrix_of(glm::conjugate(pair.X_DL.rotation) * views.left.X_DC.rotation);
    const cv::Matx33d pinhole =
        matrix_of(PixelScale{{pair.focal_px, pair.focal_px}, pair.centre_px, 0});
    const cv::Size size(pair.size_px.x, pair.size_px.y);
    cv::Mat x, y;
    if (is_fisheye) {
      cv::fisheye::initUndistortRectifyMap(matrix_of(centred(260, size_px)),
                                           cv::Vec4d(-0.01, 0.002, 0, 0), turn, pinhole, size,
                                           CV_32FC1, x, y);
    } else {
      cv::initUndistortRectifyMap(matrix_of(PixelScale{{457, 460}, {322, 236}, 0}),
                                  cv::Vec4d(-0.28, 0.075, 0.0002, 0.00002), turn, pinhole, size,
                                  CV_32FC1, x, y);
    }
    expect_places(pair, views.left, x, y);
  }
}

// A pinhole with a field of view of 2 atan(2), limited to 90 degrees: the middle half of its
// columns.
TEST(PinholePair, LimitsTheFieldOfViewAndReportsTheLostShare) {
  const LensModel lens = Pinhole{centred(160, {641, 161})};
  const auto view = [&](double x_m) {
    return view_of(lens, {641, 161}, {{1, 0, 0, 0}, {x_m, 0, 0}});
  };
  const PinholePair pair = pinhole_pair(view(0), view(0.1), glm::radians(90.0));
  EXPECT_NEAR(pair.size_px.x, 321, 1);
  EXPECT_NEAR(pair.size_px.y, 161, 1);
  for (const double lost : pair.lost_share) EXPECT_NEAR(lost, 0.5, 2.0 / 128);  // of the samples
  const PinholePair all = pinhole_pair(view(0), view(0.1), glm::radians(150.0));
  EXPECT_EQ(all.lost_share[0], 0);
}

// Half of a fisheye's field of view is behind a pinhole; the remainder keeps its size.
TEST(PinholePair, KeepsTheFocalLengthOnTheAxisOfAFisheye) {
  const Pair views = pairs()[1];
  const PinholePair pair = pinhole_pair(views.left, views.right);
  EXPECT_NEAR(pair.focal_px, 260, 1e-6);
  const double half = std::tan(glm::radians(55.0)) * 260;
  EXPECT_NEAR(pair.size_px.x, 2 * half + 1, 2);
  EXPECT_GT(pair.lost_share[0], 0);
}

void expect_refused(const StereoView& left, const StereoView& right, const char* part) {
  EXPECT_THAT([&] { pinhole_pair(left, right); },
              ThrowsMessage<Error>(AllOf(HasSubstr("stereo pair"), HasSubstr(part))));
}

TEST(PinholePair, RejectsCamerasThatCannotBeRectified) {
  const StereoView left = camera(brown(), {0, 0, 0}, {0, 0, 0});
  expect_refused(left, camera(brown(), {0.01, 0, 0.4}, {0, 0, 0}),
                 "deg from the viewing direction");
  expect_refused(left, camera(brown(), {0.01, 0, -0.4}, {0, 0, 0}), "it must be at least");
  expect_refused(left, camera(brown(), {0.3, 0, 0}, {0, 90, 0}), "turned by 90.0 deg");
  expect_refused(left, camera(brown(), {0.3, 0, 0}, {0, 0, 90}), "turned by 90.0 deg");
  expect_refused(left, left, "0 m apart");
  const LensModel narrow = Pinhole{centred(3000, size_px)};
  expect_refused(camera(narrow, {0, 0, 0}, {0, -15, 0}), camera(narrow, {0.3, 0, 0}, {0, 15, 0}),
                 "the fields of view do not overlap");
  expect_refused(camera(narrow, {0, 0, 0}, {-10, 0, 0}), camera(narrow, {0.3, 0, 0}, {10, 0, 0}),
                 "the fields of view do not overlap");
  StereoView blind = left;
  blind.ray = nullptr;
  expect_refused(blind, left, "the left view has no lens");
  StereoView empty = left;
  empty.size_px = {0, 480};
  expect_refused(left, empty, "the right image has 0 x 480 px");
  StereoView lost = left;
  lost.X_DC.translation_m.x = std::numeric_limits<double>::quiet_NaN();
  expect_refused(left, lost, "apart");
  const LensModel tele = Pinhole{centred(1e7, size_px)};
  expect_refused(camera(tele, {0, 0, 0}, {0, 0, 0}), camera(brown(), {0.3, 0, 0}, {0, 0, 0}),
                 "more than");
  EXPECT_THAT(
      [&] {
        pinhole_pair(left, camera(brown(), {0.3, 0, 0}, {}), 4);
      },
      ThrowsMessage<Error>(HasSubstr("below pi")));
}

// Converging cameras see the same objects near by, even if not far away.
TEST(PinholePair, AcceptsConvergingCameras) {
  const LensModel narrow = Pinhole{centred(3000, size_px)};
  const PinholePair pair =
      pinhole_pair(camera(narrow, {0, 0, 0}, {0, 15, 0}), camera(narrow, {0.3, 0, 0}, {0, -15, 0}));
  EXPECT_GT(pair.size_px.x, 1600);
}

}  // namespace
}  // namespace groundray::pinhole_pair_test
