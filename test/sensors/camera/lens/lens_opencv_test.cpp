#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/ccalib/omnidir.hpp>
#include <opencv2/core/persistence.hpp>
#include <random>
#include <vector>

#include "apps/scene/calibration/camera_calibration.h"
#include "sensors/camera/lens/lens.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"

// Comparison with OpenCV, where its functions implement the same models.
namespace groundray::lens_opencv_test {
namespace {

using groundray::testing::LensSample;
using groundray::testing::sample_lenses;

// Scaled to 0.3 of the last bits of 1e4 px, and to two libraries' orders of summation.
constexpr double agreed_px = 1e-9;

cv::Matx33d matrix_of(const PixelScale& scale) {
  return {scale.focal_px.x,
          scale.skew * scale.focal_px.x,
          scale.centre_px.x,
          0,
          scale.focal_px.y,
          scale.centre_px.y,
          0,
          0,
          1};
}

// Points in C that a lens images in its image or near it, less than `farthest_rad` from the axis.
std::vector<cv::Point3d> points_before(const Lens& lens, double farthest_rad) {
  std::mt19937_64 random(20260114);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<cv::Point3d> points;
  for (int i = 0; i < 20000 && points.size() < 1000; ++i) {
    const double angle = farthest_rad * unit(random), azimuth = 6.28 * unit(random);
    const glm::dvec3 p =
        (0.1 + 9 * unit(random)) * glm::dvec3(std::sin(angle) * std::cos(azimuth),
                                              std::sin(angle) * std::sin(azimuth), std::cos(angle));
    const auto pixel = lens.project(p);
    if (pixel && glm::length(*pixel) < 1000) points.emplace_back(p.x, p.y, p.z);
  }
  return points;
}

void expect_images(const Lens& lens, const std::vector<cv::Point3d>& points,
                   const std::vector<cv::Point2d>& images) {
  ASSERT_GT(points.size(), 100u);
  ASSERT_EQ(points.size(), images.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = lens.project({points[i].x, points[i].y, points[i].z});
    ASSERT_TRUE(pixel);
    EXPECT_LT(glm::distance(*pixel, {images[i].x, images[i].y}), agreed_px);
    testing::record_margin("pixel", glm::distance(*pixel, {images[i].x, images[i].y}), agreed_px,
                           "px");
  }
}

const cv::Vec3d still(0, 0, 0);

TEST(LensAgainstOpenCv, BrownConradyMatchesProjectPoints) {
  for (const LensSample& sample : sample_lenses()) {
    const auto* model = std::get_if<BrownConrady>(&sample.model);
    if (!model || model->scale.skew != 0 || sample.name == "rational 8, pole") continue;
    SCOPED_TRACE(sample.name);
    const Lens lens(sample.model, sample.size_px);
    const auto points = points_before(lens, 1.55);
    const auto last =
        std::find_if(model->k.rbegin(), model->k.rend(), [](double k) { return k != 0; });
    for (const std::ptrdiff_t count : {4, 5, 8, 12, 14}) {
      if (count < std::distance(last, model->k.rend())) continue;
      std::vector<cv::Point2d> images;
      cv::projectPoints(points, still, still, matrix_of(model->scale),
                        std::vector<double>(model->k.begin(), model->k.begin() + count), images);
      expect_images(lens, points, images);
    }
  }
}

// OpenCV represents directions by x / z, so only up to 90 degrees.
TEST(LensAgainstOpenCv, KannalaBrandtMatchesFisheye) {
  for (const LensSample& sample : sample_lenses()) {
    const auto* model = std::get_if<KannalaBrandt>(&sample.model);
    if (!model) continue;
    SCOPED_TRACE(sample.name);
    const Lens lens(sample.model, sample.size_px);
    const auto points = points_before(lens, 1.57);
    std::vector<cv::Point2d> images;
    cv::fisheye::projectPoints(points, images, still, still, matrix_of(model->scale),
                               cv::Vec4d(model->k.data()));
    expect_images(lens, points, images);
  }
}

TEST(LensAgainstOpenCv, MeiMatchesOmnidir) {
  for (const LensSample& sample : sample_lenses()) {
    const auto* model = std::get_if<Mei>(&sample.model);
    if (!model) continue;
    SCOPED_TRACE(sample.name);
    const Lens lens(sample.model, sample.size_px);
    const auto points = points_before(lens, 3);
    std::vector<cv::Point2d> images;
    cv::omnidir::projectPoints(points, images, still, still, matrix_of(model->scale), model->xi,
                               cv::Vec4d(model->k.data()));
    expect_images(lens, points, images);
  }
}

// OpenCV's own reader applied to groundray's files, and groundray's reader applied to OpenCV's.
TEST(CalibrationAgainstOpenCv, RoundTripsThroughItsFiles) {
  const PixelScale scale{{500.25, 501}, {320, 1.0 / 3}, 0};
  const std::array<double, 14> k{-0.3, 0.1, 1e-3, -2e-5, 1e-17, 1, 2.0 / 3};
  const CameraCalibration camera{
      .name = "camera", .model = BrownConrady{scale, k}, .size_px = {640, 480}};
  for (const bool xml : {false, true}) {
    const std::string text = camera_calibrations_text(
        {&camera, 1}, xml ? CalibrationFormat::OpenCvXml : CalibrationFormat::OpenCvYaml);
    const cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    cv::Mat_<double> matrix, coefficients;
    file["camera_matrix"] >> matrix;
    file["distortion_coefficients"] >> coefficients;
    EXPECT_EQ(static_cast<int>(file["image_width"]), 640);
    EXPECT_EQ(cv::norm(matrix, cv::Mat(matrix_of(scale)), cv::NORM_INF), 0);
    ASSERT_EQ(coefficients.total(), 8u);
    for (int i = 0; i < 8; ++i) EXPECT_EQ(coefficients(i), k[static_cast<std::size_t>(i)]);

    cv::FileStorage out(xml ? "x.xml" : "x.yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
    out << "image_width" << 640 << "image_height" << 480 << "camera_matrix" << matrix
        << "distortion_coefficients" << coefficients << "note"
        << "a \"quoted\" text, 'and' more";
    const auto back = parse_camera_calibrations(out.releaseAndGetString(), "x");
    ASSERT_EQ(back.size(), 1u);
    EXPECT_EQ(back[0].size_px, camera.size_px);
    EXPECT_EQ(std::get<BrownConrady>(back[0].model).k, k);
    EXPECT_EQ(std::get<BrownConrady>(back[0].model).scale.centre_px, scale.centre_px);
  }
}

}  // namespace
}  // namespace groundray::lens_opencv_test
