#include "sensors/camera/lens/stereo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <opencv2/calib3d.hpp>
#include <random>

#include "apps/scene/calibration/camera_calibration.h"
#include "core/error.h"
#include "sensors/camera/lens/lens.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"

namespace groundray::stereo_test {
namespace {

using ::testing::AllOf;
using testing::centred;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr glm::ivec2 size_px{640, 480};
// Axes of a camera that looks along x of B.
const glm::dquat R_BC(0.5, -0.5, 0.5, -0.5);

// A camera rotated by `turn_deg` about its own axes (right, down, ahead).
StereoCamera camera_at(const glm::dvec3& p_BC, const glm::dvec3& turn_deg, LensModel lens) {
  const glm::dvec3 turn = glm::radians(turn_deg);
  return {std::move(lens), size_px, {R_BC * glm::dquat(turn), p_BC}};
}

StereoCamera left_pinhole() {
  return camera_at({0.1, 0.06, 0.3}, {1, -3, 2}, Pinhole{{{500, 510}, {310, 250}, 0}});
}
StereoCamera right_pinhole() {
  return camera_at({0.12, -0.07, 0.29}, {-2, 4, -1}, Pinhole{{{520, 515}, {330, 235}, 0}});
}
StereoCamera right_fisheye() {
  return camera_at({0.1, -0.05, 0.31}, {0, 5, 10},
                   KannalaBrandt{centred(300, size_px), {-0.01, 0.002, 0, 0}});
}

// Properties of every rectified pair, at random points that both cameras see.
TEST(StereoRectification, RowsAreEqualAndDisparityIsFocalLengthTimesBaselineOverDepth) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> share(-1, 1), depth_m(0.5, 80);
  for (const StereoCamera& right : {right_pinhole(), right_fisheye()}) {
    const RectifiedPair pair = rectified(left_pinhole(), right);
    const Lens lens(Pinhole{pair.scale}, pair.size_px);
    EXPECT_EQ(pair.scale.focal_px.x, pair.scale.focal_px.y);
    EXPECT_DOUBLE_EQ(pair.baseline_m,
                     glm::distance(left_pinhole().X_BC.translation_m, right.X_BC.translation_m));
    for (int i = 0; i < 10000; ++i) {
      const double z = depth_m(random);
      const glm::dvec3 p_LQ(z * share(random), z * share(random), z);
      const auto in_left = lens.project(p_LQ);
      const auto in_right = lens.project(inverse(pair.X_BR) * (pair.X_BL * p_LQ));
      ASSERT_TRUE(in_left && in_right);
      // Rotations are rounded to 1e-16 of f max(|x|, |y|, z) / z, about 1e3 px.
      EXPECT_NEAR(in_left->y, in_right->y, 1e-9);
      EXPECT_NEAR(in_left->x - in_right->x, pair.scale.focal_px.x * pair.baseline_m / z, 1e-9);
      testing::record_margin("rows", in_left->y - in_right->y, 1e-9, "px");
      testing::record_margin("disparity",
                             in_left->x - in_right->x - pair.scale.focal_px.x * pair.baseline_m / z,
                             1e-9, "px");
    }
  }
}

// The cameras keep their positions: a point is seen in the same direction as before.
TEST(StereoRectification, RotatesTheCamerasAboutTheirCentres) {
  const RectifiedPair pair = rectified(left_pinhole(), right_fisheye());
  const glm::dvec3 p_BQ(7, 1, -2);
  for (const auto& [mounted, X_BR, R_RC] : {std::tuple(left_pinhole(), pair.X_BL, pair.R_LC),
                                            std::tuple(right_fisheye(), pair.X_BR, pair.R_RC)}) {
    EXPECT_EQ(X_BR.translation_m, mounted.X_BC.translation_m);
    const glm::dvec3 turned = R_RC * (inverse(mounted.X_BC) * p_BQ);
    EXPECT_LT(glm::distance(turned, inverse(X_BR) * p_BQ), 1e-14);
  }
}

TEST(StereoRectification, KeepsARectifiedPair) {
  const StereoCamera left = camera_at({0, 0.06, 0}, {0, 0, 0}, Pinhole{centred(500, size_px)});
  const StereoCamera right = camera_at({0, -0.06, 0}, {0, 0, 0}, Pinhole{centred(500, size_px)});
  const RectifiedPair pair = rectified(left, right);
  EXPECT_LT(glm::distance(pair.scale.focal_px, {500, 500}), 1e-10);
  EXPECT_LT(glm::distance(pair.scale.centre_px, {319.5, 239.5}), 1e-10);
  EXPECT_LT(std::abs(std::abs(glm::dot(pair.X_BL.rotation, R_BC)) - 1), 1e-15);
  EXPECT_DOUBLE_EQ(pair.baseline_m, 0.12);
}

cv::Matx33d matrix_of(const PixelScale& s) {
  return {s.focal_px.x, 0, s.centre_px.x, 0, s.focal_px.y, s.centre_px.y, 0, 0, 1};
}
cv::Matx33d matrix_of(const glm::dquat& q) {
  const glm::dmat3 m = glm::mat3_cast(q);
  return {m[0][0], m[1][0], m[2][0], m[0][1], m[1][1], m[2][1], m[0][2], m[1][2], m[2][2]};
}

TEST(StereoRectification, MatchesOpenCvsRotations) {
  for (const StereoCamera& right : {right_pinhole(), right_fisheye()}) {
    const StereoCamera left = left_pinhole();
    const RectifiedPair pair = rectified(left, right);
    const Pose X_RL = inverse(right.X_BC) * left.X_BC;
    const glm::dvec3& t = X_RL.translation_m;
    cv::Matx33d left_turn, right_turn;
    cv::Matx34d left_projection, right_projection;
    cv::Matx44d to_depth;
    // The rotations do not depend on the lenses.
    const cv::Matx33d any = matrix_of(pair.scale);
    cv::stereoRectify(any, cv::noArray(), any, cv::noArray(), {size_px.x, size_px.y},
                      matrix_of(X_RL.rotation), cv::Vec3d(t.x, t.y, t.z), left_turn, right_turn,
                      left_projection, right_projection, to_depth);
    // Both libraries round a few times in converting half rotations to Rodrigues vectors and back.
    EXPECT_LT(cv::norm(left_turn, matrix_of(pair.R_LC), cv::NORM_INF), 1e-13);
    EXPECT_LT(cv::norm(right_turn, matrix_of(pair.R_RC), cv::NORM_INF), 1e-13);
    testing::record_margin("turns",
                           std::max(cv::norm(left_turn, matrix_of(pair.R_LC), cv::NORM_INF),
                                    cv::norm(right_turn, matrix_of(pair.R_RC), cv::NORM_INF)),
                           1e-13);
    EXPECT_NEAR(right_projection(0, 3) / right_projection(0, 0), -pair.baseline_m, 1e-14);
  }
}

// With equal cameras that converge symmetrically, the loss on one side of one image equals that on
// the opposite side of the other.
TEST(StereoRectification, CentresTheCommonFieldOfView) {
  const LensModel lens = Pinhole{centred(500, size_px)};
  const RectifiedPair pair = rectified(camera_at({0, 0.06, 0}, {0, 8, 0}, lens),
                                       camera_at({0, -0.06, 0}, {0, -8, 0}, lens));
  EXPECT_NEAR(pair.scale.centre_px.x, 319.5, 1e-9);
  EXPECT_NEAR(pair.scale.centre_px.y, 239.5, 1e-9);
  EXPECT_NEAR(pair.scale.focal_px.x, 500, 1e-9);
}

void expect_refused(const StereoCamera& left, const StereoCamera& right, const char* part) {
  EXPECT_THAT([&] { rectified(left, right); },
              ThrowsMessage<Error>(AllOf(HasSubstr("stereo pair"), HasSubstr(part))));
}

TEST(StereoRectification, RejectsPairsThatCannotBeRectified) {
  const LensModel lens = Pinhole{centred(500, size_px)};
  const StereoCamera left = camera_at({0, 0.06, 0}, {0, 0, 0}, lens);
  expect_refused(left, camera_at({0, -0.06, 0}, {0, 75, 0}, lens),
                 "relative rotation of the cameras is 75.0 deg, but must be at most 60");
  expect_refused(camera_at({0, -0.06, 0}, {0, 0, 0}, lens), left, "are they swapped");
  expect_refused(left, camera_at({0.3, -0.06, 0}, {0, 0, 0}, lens), "(0.12, 0, 0.3) m");
  expect_refused(left, left, "to its right within 45 deg");
  StereoCamera small = camera_at({0, -0.06, 0}, {0, 0, 0}, lens);
  small.size_px.x = 320;
  expect_refused(left, small, "the right one 320 x 480: they must be equal");
  const LensModel wide = KannalaBrandt{centred(200, size_px), {}};
  expect_refused(left, camera_at({0, -0.06, 0}, {0, 0, 0}, wide),
                 "the right camera sees 91.5 deg from the pair's common axis at the left side");
}

TEST(StereoRectification, WritesRosFiles) {
  const StereoCamera left = left_pinhole(), right = right_fisheye();
  const RectifiedPair pair = rectified(left, right);
  const CameraCalibration camera{
      .name = "right",
      .model = right.lens,
      .size_px = size_px,
      .rectification = Rectification{pair.R_RC, pair.scale, pair.baseline_m}};
  const std::string text = camera_calibrations_text({&camera, 1}, CalibrationFormat::RosYaml);
  const auto numbers = [&](const char* key) {
    std::vector<double> values;
    const std::size_t at = text.find("data: [", text.find(key)) + 7;
    std::istringstream list(text.substr(at, text.find(']', at) - at));
    for (std::string word; std::getline(list, word, ',');) values.push_back(std::stod(word));
    return values;
  };
  const auto projection = numbers("projection_matrix");
  const auto turn = numbers("rectification_matrix");
  ASSERT_EQ(projection.size(), 12u);
  ASSERT_EQ(turn.size(), 9u);
  // As readers of the file use it: [u v 1] w = P [p 1], for a point in the left rectified camera.
  const Lens lens(Pinhole{pair.scale}, size_px);
  const glm::dvec3 p_LQ(0.4, -0.3, 2), p_CQ = inverse(right.X_BC) * (pair.X_BL * p_LQ);
  const double w = projection[8] * p_LQ.x + projection[9] * p_LQ.y + projection[10] * p_LQ.z;
  const double u = (projection[0] * p_LQ.x + projection[2] * p_LQ.z + projection[3]) / w;
  const glm::dvec3 turned(turn[0] * p_CQ.x + turn[1] * p_CQ.y + turn[2] * p_CQ.z,
                          turn[3] * p_CQ.x + turn[4] * p_CQ.y + turn[5] * p_CQ.z,
                          turn[6] * p_CQ.x + turn[7] * p_CQ.y + turn[8] * p_CQ.z);
  const auto pixel = lens.project(turned);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x, u, 1e-9);
  EXPECT_THAT(
      [&] {
        camera_calibrations_text({&camera, 1}, CalibrationFormat::OpenCvYaml);
      },
      ThrowsMessage<Error>(HasSubstr("its rectification is not supported")));
}

}  // namespace
}  // namespace groundray::stereo_test
