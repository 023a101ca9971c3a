#include "apps/scene/calibration/camera_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <glm/geometric.hpp>
#include <iterator>
#include <map>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/io/file_io.h"
#include "sensors/camera/lens/lens.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"

namespace groundray::calibration_test {
namespace {

using groundray::testing::centred;
using groundray::testing::LensSample;
using groundray::testing::sample_lenses;
using groundray::testing::shared_data_folder;
using groundray::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;
using enum CalibrationFormat;

constexpr std::array all_formats{RosYaml,    OpenCvYaml, OpenCvXml,
                                 KalibrYaml, ColmapText, BasaltJson};

const std::string ros = R"(image_width: 640
image_height: 480
camera_name: left
camera_matrix:
  rows: 3
  cols: 3
  data: [500.5, 0, 319.5, 0, 501, 239.25, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.3, 0.1, 1e-3, -2e-3, -0.02]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
)";

const std::string opencv = R"(%YAML:1.0
---
calibration_time: "Sat"
image_width: 640
image_height: 480
flags: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.005e+02, 0., 319.5, 0., 501., 239.25, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -3.0e-01, 0.1, 1.0e-03,
       -2.0e-03, -0.02 ]
)";

const std::string opencv_xml = R"(<?xml version="1.0"?>
<opencv_storage>
<image_width>640</image_width>
<image_height>480</image_height>
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    500.5 0. 319.5 0.
    501. 239.25 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix">
  <rows>5</rows>
  <cols>1</cols>
  <dt>d</dt>
  <data>
    -0.3 0.1 1e-3 -2e-3 -0.02</data></distortion_coefficients>
</opencv_storage>
)";

const std::string kalibr = R"(cam0:
  camera_model: ds
  intrinsics: [-0.2, 0.59, 317.5, 316.25, 724.5, 546.75]
  distortion_model: none
  distortion_coeffs: []
  resolution: [1440, 1080]
  T_cam_imu:
    - [0, 1, 0, 0.1]
    - [0, 0, 1, 0.2]
    - [1, 0, 0, 0.3]
    - [0, 0, 0, 1]
  timeshift_cam_imu: 0.0025
cam1:
  camera_model: omni
  intrinsics: [0.8, 833, 830, 373.5, 253.75]
  distortion_model: radtan
  distortion_coeffs: [-0.33, 0.13, 1e-4, 2e-4]
  resolution: [752, 480]
  T_cn_cnm1:
    - [1, 0, 0, -0.11]
    - [0, 1, 0, 0]
    - [0, 0, 1, 0]
    - [0.0, 0, 0, 1]
)";

std::string with(std::string text, std::string_view from, std::string_view to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::vector<CameraCalibration> parsed(const std::string& text) {
  return parse_camera_calibrations(text, "c.txt");
}

template <typename... Parts>
void expect_refused(const std::string& text, Parts... parts) {
  EXPECT_THAT([&] { parsed(text); }, ThrowsMessage<Error>(AllOf(HasSubstr(parts)...)));
}

TEST(CameraCalibration, RosAndOpenCvInYamlAndXmlYieldTheSame) {
  for (const std::string& text : {ros, opencv, opencv_xml}) {
    const auto cameras = parsed(text);
    ASSERT_THAT(cameras, SizeIs(1));
    EXPECT_EQ(cameras[0].size_px, glm::ivec2(640, 480));
    const auto& model = std::get<BrownConrady>(cameras[0].model);
    EXPECT_EQ(model.scale.focal_px, glm::dvec2(500.5, 501));
    EXPECT_EQ(model.scale.centre_px, glm::dvec2(319.5, 239.25));
    EXPECT_EQ(model.k, (std::array<double, 14>{-0.3, 0.1, 1e-3, -2e-3, -0.02}));
    EXPECT_FALSE(cameras[0].X_IC || cameras[0].X_FC);
  }
  EXPECT_EQ(parsed(ros)[0].name, "left");
  EXPECT_TRUE(std::holds_alternative<KannalaBrandt>(parsed(with(
      with(with(ros, "plumb_bob", "equidistant"), "cols: 5", "cols: 4"), ", -0.02", ""))[0]
                                                        .model));
  EXPECT_TRUE(std::holds_alternative<KannalaBrandt>(parsed(with(
      with(with(opencv, "flags: 0", "fisheye_model: 1"), "rows: 5", "rows: 4"), ", -0.02", ""))[0]
                                                        .model));
}

TEST(CameraCalibration, ReadsAKalibrChain) {
  const auto cameras = parsed(kalibr);
  ASSERT_THAT(cameras, SizeIs(2));
  const auto& sphere = std::get<DoubleSphere>(cameras[0].model);
  EXPECT_EQ(sphere.xi, -0.2);
  EXPECT_EQ(sphere.alpha, 0.59);
  EXPECT_EQ(sphere.scale.focal_px, glm::dvec2(317.5, 316.25));
  EXPECT_EQ(sphere.scale.centre_px, glm::dvec2(724.5, 546.75));
  const auto& mei = std::get<Mei>(cameras[1].model);
  EXPECT_EQ(mei.xi, 0.8);
  EXPECT_EQ(mei.k, (std::array{-0.33, 0.13, 1e-4, 2e-4}));
  EXPECT_EQ(cameras[0].time_shift_s, 0.0025);
  // The camera's axes x, y, z are the IMU's y, z, x; p_I = R^T (0 - t).
  ASSERT_TRUE(cameras[0].X_IC);
  EXPECT_LT(glm::distance(*cameras[0].X_IC * glm::dvec3(0), {-0.3, -0.1, -0.2}), 1e-15);
  EXPECT_LT(glm::distance(*cameras[0].X_IC * glm::dvec3(0, 0, 1), {0.7, -0.1, -0.2}), 1e-15);
  EXPECT_FALSE(cameras[1].X_IC);
  ASSERT_TRUE(cameras[1].X_FC);
  EXPECT_EQ(cameras[1].X_FC->translation_m, glm::dvec3(0.11, 0, 0));
}

TEST(CameraCalibration, MovesColmapsPixelCentresToWholeNumbers) {
  const auto cameras = parsed(
      "# Camera list\n1 SIMPLE_RADIAL 640 480 500 320 240 -0.1\n"
      "7 FULL_OPENCV 640 480 500 501 320 240.5 1 2 3 4 5 6 7 8\n3 EQUIRECTANGULAR 200 100 200 100\n"
      "4 EUCM 640 480 300 301 320 240 0.6 1.1\n5 FISHEYE 640 480 300 301 320 240\n");
  ASSERT_THAT(cameras, SizeIs(5));
  const auto& radial = std::get<BrownConrady>(cameras[0].model);
  EXPECT_EQ(radial.scale.centre_px, glm::dvec2(319.5, 239.5));
  EXPECT_EQ(radial.k[0], -0.1);
  EXPECT_EQ(cameras[1].name, "7");
  const auto& full = std::get<BrownConrady>(cameras[1].model);
  EXPECT_EQ(full.k, (std::array<double, 14>{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(full.scale.centre_px.y, 240);
  EXPECT_EQ(std::get<Eucm>(cameras[3].model).beta, 1.1);
}

// Two lenses are the same if they image directions to the same pixels, whatever their names. The
// tolerance is half a ulp, for centres that were moved by half a pixel and back.
void expect_same_lens(LensModel a, const LensModel& b, glm::ivec2 size_px) {
  if (auto* all_round = std::get_if<Equirectangular>(&a)) all_round->size_px = size_px;
  for (double x = -0.5; x < 0.6; x += 0.2) {
    for (double y = -0.5; y < 0.6; y += 0.2) {
      const glm::dvec3 p = glm::normalize(glm::dvec3(x, y, 1));
      const auto image = [&](const auto& kind) {
        const auto [u, v] = kind.image(Direction<double>{p.x, p.y, p.z});
        return glm::dvec2(u, v);
      };
      EXPECT_LT(glm::distance(std::visit(image, a), std::visit(image, b)), 1e-13);
    }
  }
}

TEST(CameraCalibration, RoundTripsThroughEveryFormatThatSupportsIt) {
  const Pose X_IC{glm::normalize(glm::dquat(0.7, 0.1, -0.3, 0.5)), {0.1, -1e-7, 3}};
  std::multiset<CalibrationFormat> said;
  for (const LensSample& sample : sample_lenses()) {
    SCOPED_TRACE(sample.name);
    for (const CalibrationFormat format : all_formats) {
      CameraCalibration camera{
          .name = "front 'left'", .model = sample.model, .size_px = sample.size_px};
      if (format == KalibrYaml) camera.time_shift_s = -1.25e-3;
      if (format == KalibrYaml || format == BasaltJson) camera.X_IC = X_IC;
      std::string text;
      try {
        text = camera_calibrations_text({&camera, 1}, format);
      } catch (const Error&) {
        continue;
      }
      said.insert(format);
      const auto back = parsed(text);
      ASSERT_THAT(back, SizeIs(1)) << text;
      EXPECT_EQ(back[0].size_px, camera.size_px);
      EXPECT_EQ(back[0].time_shift_s, camera.time_shift_s);
      EXPECT_TRUE(format != RosYaml || back[0].name == camera.name);
      ASSERT_EQ(back[0].X_IC.has_value(), camera.X_IC.has_value());
      if (camera.X_IC) {
        const glm::dvec3 p_C(1, 2, 3);
        EXPECT_LT(glm::distance(*back[0].X_IC * p_C, X_IC * p_C), 1e-14);
      }
      expect_same_lens(camera.model, back[0].model, camera.size_px);
    }
  }
  // Pinholes 2 (one with skew), Brown-Conrady 9, Kannala-Brandt 4, EUCM 3, double sphere 3, Mei 3.
  EXPECT_EQ(said.count(RosYaml), 2u + 6 + 4);
  EXPECT_EQ(said.count(OpenCvYaml), 2u + 8 + 4 + 3);
  EXPECT_EQ(said.count(OpenCvXml), said.count(OpenCvYaml));
  EXPECT_EQ(said.count(KalibrYaml), 2u + 1 + 4 + 3 + 3 + 2);
  EXPECT_EQ(said.count(ColmapText), 2u + 6 + 4 + 3 + 1);
  EXPECT_EQ(said.count(BasaltJson), 2u + 6 + 4 + 3 + 3);
}

TEST(CameraCalibration, RoundTripsAChain) {
  const auto cameras = parsed(kalibr);
  const TemporaryFolder folder;
  write_text(folder / "chain.yaml", camera_calibrations_text(cameras, KalibrYaml));
  const auto back = load_camera_calibrations(folder / "chain.yaml");
  ASSERT_THAT(back, SizeIs(2));
  EXPECT_EQ(back[1].X_FC, cameras[1].X_FC);
  EXPECT_EQ(back[0].time_shift_s, cameras[0].time_shift_s);
  EXPECT_EQ(std::get<DoubleSphere>(back[0].model).xi, -0.2);
}

TEST(CameraCalibration, RejectsModelsThatAFormatDoesNotSupport) {
  const auto refused = [](const std::vector<CameraCalibration>& cameras, CalibrationFormat format,
                          auto... parts) {
    EXPECT_THAT([&] { camera_calibrations_text(cameras, format); },
                ThrowsMessage<Error>(AllOf(HasSubstr(parts)...)));
  };
  const PixelScale scale = centred(100, {64, 48});
  const CameraCalibration plain{.name = "a", .model = Pinhole{scale}, .size_px = {64, 48}};
  refused({}, RosYaml, "for ROS", "there must be at least one");
  refused({plain, plain}, OpenCvXml, "for OpenCV", "a file contains one camera, not 2");
  CameraCalibration odd = plain;
  odd.X_IC = Pose{};
  odd.time_shift_s = 1;
  odd.size_px = {0, 0};
  refused({odd}, ColmapText, "a: its pose is not supported: reset X_IC", "time_shift_s",
          "size_px is missing");
  refused({plain}, BasaltJson, "a: X_IC is missing");
  CameraCalibration placed = plain;
  placed.X_FC = Pose{.rotation = {1, 0, 0, 0}, .translation_m = {1, 0, 0}};
  refused({plain, placed}, KalibrYaml, "1 of 2 cameras have X_FC");
  refused({placed, placed}, KalibrYaml, "X_FC of the first camera must be the identity");
  refused({placed}, BasaltJson, "reset X_FC");
  CameraCalibration tilted = plain;
  tilted.model = BrownConrady{scale, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.01, 0}};
  for (const CalibrationFormat format : {RosYaml, KalibrYaml, ColmapText, BasaltJson})
    refused({tilted}, format, "a: its lens is not supported, only a pinhole");
  CameraCalibration askew = plain;
  askew.model = Pinhole{{{100, 100}, {31, 23}, 0.01}};
  for (const CalibrationFormat format : all_formats) refused({askew}, format, "its skew");
  CameraCalibration polynomial = plain;
  polynomial.model = FTheta{{31, 23}, FTheta::Polynomial::AngleToPixels, {50}};
  for (const CalibrationFormat format : all_formats) refused({polynomial}, format, "its lens");
}

TEST(CameraCalibration, ListsEveryFaultOfAFile) {
  expect_refused("", "c.txt:1:1: the file is empty");
  expect_refused("imu0:\n  model: calibrated\n", "c.txt:1:1: not a camera calibration", "cam0");
  expect_refused(with(ros, "plumb_bob", "plum_bob"), "c.txt:8:19: key 'distortion_model'",
                 "must be one of plumb_bob, rational_polynomial, equidistant",
                 "did you mean 'plumb_bob'?");
  expect_refused(with(with(ros, "cols: 5", "cols: 4"), "plumb_bob", "rational_polynomial"),
                 "c.txt:12:9: key 'data': has 5 numbers, but its rows and cols are 1 x 4");
  expect_refused(with(ros, "plumb_bob", "rational_polynomial"), "c.txt:10:3",
                 "has 5 coefficients, but its model has 8: k1 k2 p1 p2 k3 k4 k5 k6");
  expect_refused(with(ros, "[500.5, 0,", "[500.5, 0.1,"), "has a skew of 0.1");
  expect_refused(with(ros, "[500.5, 0,", "[-500.5, 0,"),
                 "focal lengths of (-500.5, 501) px must be positive");
  expect_refused(with(ros, "image_width: 640", "image_width: 6.4"), "c.txt:1:14",
                 "whole number of pixels");
  expect_refused(with(ros, "image_width: 640\n", ""), "key 'image_width': missing");
  expect_refused(with(ros, "501, 239", ".nan, 239"), "c.txt:7", "finite");
  expect_refused(with(opencv, "rows: 5", "rows: 6"), "c.txt:16", "its rows and cols are 6 x 1");
  expect_refused(with(opencv, "camera_matrix", "camera_matrx"), "contains no camera",
                 "cameraMatrix");
  expect_refused(with(opencv_xml, "500.5", "5oo"), "c.txt:9", "'5oo'");
  expect_refused(with(opencv_xml, "</opencv_storage>", ""), "c.txt:", "not XML");
  expect_refused("<a></a>", "the element opencv_storage is missing");
  expect_refused(with(kalibr, "camera_model: ds", "camera_model: dss"), "c.txt:2:17",
                 "must be one of pinhole, omni, eucm, ds", "did you mean 'ds'?");
  expect_refused(with(kalibr, "[-0.2, ", "["), "c.txt:3:15", "has 5 numbers, but must have 6",
                 "xi alpha f_u f_v c_u c_v");
  expect_refused(with(kalibr, "[0, 1, 0, 0.1]", "[0, 1, 1, 0.1]"), "key 'T_cam_imu'",
                 "must have a rotation");
  expect_refused(with(kalibr, "[0.0, 0, 0, 1]", "[0.0, 0, 0, 2]"), "must end with the row 0 0 0 1");
  expect_refused(with(kalibr, "radtan", "fov"), "is 'fov', but for omni must be radtan or none");
  expect_refused(with(kalibr, "0.59", "1.59"), "alpha = 1.59 must be from 0 to 1");
  expect_refused(
      "\n1 THIN_PRISM_FISHEYE 640 480 1\n2 PINHOLE 640 480 1 2 3\n3 PINHOLE 6.5 4 1 1 1 1",
      "c.txt:2", "the model 'THIN_PRISM_FISHEYE' must be one of SIMPLE_PINHOLE", "c.txt:3",
      "PINHOLE has 5 numbers, but must have 6: width height fx fy cx cy", "c.txt:4",
      "the size 6.5 x 4");
  expect_refused(R"({"value0": {"intrinsics": [{"camera_type": "fov", "intrinsics": )"
                 R"({"fx": 1, "fy": 1, "cx": 0}}], "resolution": [[4, 3]], "T_imu_cam": []}})",
                 "has 1 intrinsics, 1 resolutions and 0 poses");
  EXPECT_THAT([] { load_camera_calibrations("no/such.yaml"); },
              ThrowsMessage<Error>(HasSubstr("no/such.yaml")));
}

struct PublishedCalibrations : ::testing::Test {
  void SetUp() override {
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no published calibrations in " << folder;
  }
  const std::filesystem::path folder = shared_data_folder() / "camera";
};

// Lenses that fold within their images, and the radius of the fold: the root of 1 + 3 k1 s + 5 k2
// s^2 + ..., at theta = 1.4275 for the first, r = 0.7304 and 0.9785 for the others.
struct Fold {
  glm::dvec2 centre_px;
  double reach_px;
};
const std::map<std::string, Fold> folds{
    {"uzhfpv_outdoor_45__kalibr_imucam_chain.yaml cam1", {{314.61, 251.04}, 273.3 * 1.3506}},
    {"intrinsics.yml camera1", {{335.69, 240.66}, 534.8 * 0.6304}},
    {"intrinsics.yml camera2", {{334.56, 242.05}, 534.8 * 0.7195}}};

TEST_F(PublishedCalibrations, AreReadAndInvertedAtEveryPixel) {
  std::size_t cameras = 0, blind = 0;
  for (const char* part : {"kalibr_yaml", "ds_eucm_json", "opencv_chessboard"}) {
    for (const auto& entry : std::filesystem::directory_iterator(folder / part)) {
      const std::string name = entry.path().filename().string();
      if (name.find("imucam") == std::string::npos && !name.ends_with(".json") &&
          !name.ends_with("intrinsics.yml"))
        continue;
      for (const CameraCalibration& camera : load_camera_calibrations(entry.path())) {
        SCOPED_TRACE(name + " " + camera.name);
        ++cameras;
        // OpenCV's stereo file holds no image size; its images have this one.
        const glm::ivec2 size_px = camera.size_px.x > 0 ? camera.size_px : glm::ivec2(640, 480);
        EXPECT_EQ(camera.size_px.x == 0, name == "intrinsics.yml");
        const Lens lens(camera.model, size_px);
        std::vector<PixelRay> rays(static_cast<std::size_t>(size_px.x));
        for (int y = 0; y < size_px.y; y += 37) {
          lens.fill(y, y + 1, rays);
          for (int x = 0; x < size_px.x; ++x) {
            const auto back = lens.project(rays[static_cast<std::size_t>(x)].direction);
            if (!back) ++blind;
            EXPECT_LT(back ? glm::distance(*back, {x, y}) : 0, 1e-9);
            if (back) testing::record_margin("pixel", glm::distance(*back, {x, y}), 1e-9, "px");
            const auto fold = folds.find(name + " " + camera.name);
            EXPECT_TRUE(back ||
                        (fold != folds.end() && glm::distance({x, y}, fold->second.centre_px) >
                                                    fold->second.reach_px - 0.5))
                << x << ", " << y;
          }
        }
      }
    }
  }
  EXPECT_EQ(cameras, 24u + 8 + 3);
  EXPECT_GT(blind, 0);
  EXPECT_THROW(load_camera_calibrations(folder / "kalibr_yaml/kaist__kalibr_imu_chain.yaml"),
               Error);
}

// Two groups calibrated the same fisheye cameras, one with the Kannala-Brandt model, one with the
// double sphere model.
TEST_F(PublishedCalibrations, OfOneCameraAgree) {
  const auto kalibr_cameras =
      load_camera_calibrations(folder / "kalibr_yaml/tum_vi__kalibr_imucam_chain.yaml");
  for (const char* file : {"tumvi_512_ds_calib.json", "tumvi_512_eucm_calib.json"}) {
    const auto basalt_cameras = load_camera_calibrations(folder / "ds_eucm_json" / file);
    ASSERT_THAT(basalt_cameras, SizeIs(2));
    for (std::size_t i = 0; i < 2; ++i) {
      const CameraCalibration &a = kalibr_cameras[i], &b = basalt_cameras[i];
      EXPECT_LT(glm::distance(a.X_IC->translation_m, b.X_IC->translation_m), 0.01);
      const Lens one(a.model, a.size_px), other(b.model, b.size_px);
      for (int azimuth = 0; azimuth < 360; azimuth += 15) {
        for (const double angle : {0.1, 0.5, 1.0, 1.4}) {
          const double t = azimuth * std::numbers::pi / 180;
          const glm::dvec3 p(std::sin(angle) * std::cos(t), std::sin(angle) * std::sin(t),
                             std::cos(angle));
          const glm::dvec3 p_I = a.X_IC->rotation * p;
          const auto u = one.project(p), v = other.project(glm::inverse(b.X_IC->rotation) * p_I);
          ASSERT_TRUE(u && v);
          EXPECT_LT(glm::distance(*u, *v), 2) << angle;
        }
      }
    }
  }
}

// The chain of cameras and that of the IMU are two routes to the same pose.
TEST_F(PublishedCalibrations, OfAChainFormAClosedLoop) {
  const auto cameras =
      load_camera_calibrations(folder / "kalibr_yaml/kaist_vio__kalibr_imucam_chain.yaml");
  ASSERT_THAT(cameras, SizeIs(2));
  const Pose X_FC = inverse(*cameras[0].X_IC) * *cameras[1].X_IC;
  EXPECT_LT(glm::distance(X_FC.translation_m, cameras[1].X_FC->translation_m), 1e-6);
  EXPECT_LT(glm::distance(X_FC * glm::dvec3(0, 0, 1), *cameras[1].X_FC * glm::dvec3(0, 0, 1)),
            1e-6);
}

}  // namespace
}  // namespace groundray::calibration_test
