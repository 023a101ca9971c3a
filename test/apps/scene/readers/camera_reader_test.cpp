#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "sensors/camera/lens/lens.h"
#include "test/support/lens_samples.h"
#include "test/support/scans/lidar_file.h"
#include "test/support/temporary_folder.h"

namespace groundray::camera_reader_test {
namespace {

using groundray::testing::lidar_text;
using groundray::testing::sample_lenses;
using groundray::testing::TemporaryFolder;
using groundray::testing::with;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr const char* camera_text = R"(groundray_camera: 1
model: A camera of four pixels by three
size_px: [4, 3]
lens:
  brown_conrady:
    focal_px: [200, 210]
    centre_px: [1.5, 1]
    coefficients: [-0.1, 0.02, 0.001, -0.002, 0.003]
rate_hz: 25
first_ms: 3
shutter: {exposure_ms: 4, row_us: 15}
aperture: {f_number: 2.8, focal_length_mm: 6, focus_m: 10, transmission: 0.9, vignetting: [-0.1, 0.02, -0.003], pupil: turning}
sampling: {samples: 32, most_samples: 256, relative_error: 0.01, depth: 5}
imager:
  pixel_pitch_um: 3.45
  filter: grbg
  quantum_efficiency: [0.4, 0.5, 0.3]
  full_well_e: 12000
  read_noise_e: 2.5
  dark_current_e_s: 7
  reference_c: 20
  temperature_c: 40
  doubling_k: 6
  prnu_percent: 1.5
  dsnu_e: 0.5
  gain_dn_e: 0.3
  black_dn: 64
  bits: 14
  noise: off
picture: {encoding: linear, bits: 16, gains: [2, 1, 1.5]}
products: [raw, picture, truth, flow_kitti]
sources:
  all: made up
)";

CameraSpec parse(const std::string& text) { return parse_camera(text, "mine.yaml"); }

std::string complaint_of(const std::string& text) {
  try {
    parse(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "no complaint";
}

std::string complaint(std::string_view old, std::string_view fresh) {
  return complaint_of(with(camera_text, old, fresh));
}

TEST(CameraFile, ReadsEveryKey) {
  const CameraSpec camera = parse(camera_text);
  EXPECT_EQ(camera.model, "A camera of four pixels by three");
  EXPECT_EQ(camera.size_px, glm::ivec2(4, 3));
  EXPECT_EQ(camera.rate_hz, 25);
  EXPECT_DOUBLE_EQ(camera.first_s, 3e-3);
  EXPECT_DOUBLE_EQ(camera.shutter.exposure_s, 4e-3);
  EXPECT_DOUBLE_EQ(camera.shutter.row_s, 15e-6);
  ASSERT_TRUE(camera.aperture);
  EXPECT_EQ(camera.aperture->f_number, 2.8);
  EXPECT_DOUBLE_EQ(camera.aperture->focal_length_m, 6e-3);
  EXPECT_EQ(camera.aperture->focus_m, 10);
  EXPECT_EQ(camera.aperture->transmission, 0.9);
  EXPECT_EQ(camera.aperture->vignetting, glm::dvec3(-0.1, 0.02, -0.003));
  EXPECT_EQ(camera.aperture->pupil, ApertureSpec::Pupil::Turning);
  EXPECT_EQ(camera.sampling.samples, 32);
  EXPECT_EQ(camera.sampling.most_samples, 256);
  EXPECT_EQ(camera.sampling.relative_error, 0.01);
  EXPECT_EQ(camera.sampling.depth, 5);
  EXPECT_EQ(camera.picture.encoding, PictureSpec::Encoding::Linear);
  EXPECT_EQ(camera.picture.bits, 16);
  EXPECT_EQ(camera.picture.gains, glm::dvec3(2, 1, 1.5));
  EXPECT_THAT(camera.products, ElementsAre(CameraProduct::Raw, CameraProduct::Picture,
                                           CameraProduct::Truth, CameraProduct::FlowKitti));
}

TEST(CameraFile, ReadsEveryKeyOfAnImager) {
  const CameraSpec camera = parse(camera_text);
  ASSERT_TRUE(camera.imager);
  const ImagerSpec& imager = *camera.imager;
  EXPECT_DOUBLE_EQ(imager.pixel_pitch_m, 3.45e-6);
  EXPECT_EQ(imager.filter, ColorFilter::Grbg);
  EXPECT_EQ(imager.quantum_efficiency, glm::dvec3(0.4, 0.5, 0.3));
  EXPECT_EQ(imager.full_well_e, 12000);
  EXPECT_EQ(imager.read_noise_e, 2.5);
  EXPECT_EQ(imager.dark_current_e_s, 7);
  EXPECT_EQ(imager.reference_c, 20);
  EXPECT_EQ(imager.temperature_c, 40);
  EXPECT_EQ(imager.doubling_k, 6);
  EXPECT_DOUBLE_EQ(imager.prnu, 0.015);
  EXPECT_EQ(imager.dsnu_e, 0.5);
  EXPECT_EQ(imager.gain_dn_e, 0.3);
  EXPECT_EQ(imager.black_dn, 64);
  EXPECT_EQ(imager.bits, 14);
  EXPECT_FALSE(imager.noise);
  EXPECT_EQ(parse(with(camera_text, "[0.4, 0.5, 0.3]", "0.6")).imager->quantum_efficiency,
            glm::dvec3(0.6));
}

TEST(CameraFile, RequiresOnlyModelSizeAndLens) {
  const CameraSpec camera =
      parse("{groundray_camera: 1, model: m, size_px: [64, 32], lens: {equirectangular: {}}}");
  EXPECT_EQ(camera.shutter.row_s, 0);
  EXPECT_FALSE(camera.aperture);
  EXPECT_FALSE(camera.imager);
  EXPECT_THAT(camera.products, ElementsAre(CameraProduct::Radiance, CameraProduct::Truth));
  EXPECT_THAT(complaint_of("groundray_camera: 1\n"),
              AllOf(HasSubstr("key 'model': missing"), HasSubstr("key 'size_px': missing"),
                    HasSubstr("key 'lens': missing")));
}

TEST(CameraFile, MostSamplesDefaultsToSamples) {
  const CameraSpec camera = parse(with(camera_text, ", most_samples: 256", ""));
  EXPECT_EQ(camera.sampling.most_samples, 32);
}

// Puts a lens in the place of the one in the camera file above.
LensModel lens_of(const std::string& lens) {
  const std::string_view all = camera_text;
  const auto begin = all.find("  brown_conrady"), end = all.find("rate_hz");
  return parse(with(camera_text, all.substr(begin, end - begin), "  " + lens + "\n")).lens;
}

// The parameters of each model, distinguished by their effect: the pixel of (0.3, -0.2, 0.9),
// normalised, by the model's formula in docs/theory/camera_lens.md, evaluated independently in
// Python.
TEST(CameraFile, ReadsEveryLensModel) {
  const std::string scale = "focal_px: [200, 210], centre_px: [320, 240]";
  const std::pair<std::string, glm::dvec2> lenses[] = {
      {"pinhole: {" + scale + ", skew: 0.01}", {386.222222222222, 193.333333333333}},
      {"brown_conrady: {" + scale + ", coefficients: [-0.2, 0.1, 0.01, -0.02]}",
       {382.871310267744, 195.877737133567}},
      {"brown_conrady: {" + scale +
           ", coefficients: [-0.2, 0.1, 0.01, -0.02, 0.03, 0.2, 0.1, 0.05, 0.01, 0.02, 0.03, 0.04, "
           "0.02, -0.03]}",
       {381.471760544189, 198.438912340106}},
      {"kannala_brandt: {" + scale + ", coefficients: [0.1, -0.02, 0.003, -0.0004]}",
       {384.303021494989, 194.987884953508}},
      {"f_theta: {centre_px: [320, 240], polynomial: angle_to_pixels, coefficients: [300, 5, -2], "
       "linear: [1.1, 0.02, 0.03]}",
       {423.912279107373, 179.118879418687}},
      {"f_theta: {centre_px: [320, 240], polynomial: pixels_to_angle, coefficients: [0.003, "
       "1.0e-6]}",
       {421.549633445416, 172.300244369723}},
      {"eucm: {" + scale + ", alpha: 0.6, beta: 1.1}", {383.443033549623, 195.589876515264}},
      {"ucm: {" + scale + ", alpha: 0.6}", {383.713098531598, 195.400831027882}},
      {"double_sphere: {" + scale + ", xi: -0.2, alpha: 0.6}", {399.14205309624, 184.600562832632}},
      {"mei: {" + scale + ", xi: 0.8, coefficients: [-0.2, 0.1, 0.01, -0.02]}",
       {354.956431989314, 215.498087104442}},
      {"mei: {" + scale + ", xi: 0.8}", {355.807453785044, 214.934782350469}}};
  for (const auto& [text, pixel] : lenses) {
    const auto found = Lens(lens_of(text), {640, 480}).project({0.3, -0.2, 0.9});
    ASSERT_TRUE(found) << text;
    EXPECT_NEAR(found->x, pixel.x, 1e-9) << text;  // the figures above are rounded to 1e-12
    EXPECT_NEAR(found->y, pixel.y, 1e-9) << text;
  }
}

// To the last bit: numbers are written with the fewest digits that restore them exactly.
TEST(CameraFile, WrittenLensesAreReadBackExactly) {
  for (const auto& [name, model, size_px] : sample_lenses()) {
    const std::string text = lens_text(model);
    const LensModel again = lens_of(text);
    ASSERT_EQ(again.index(), model.index()) << name;
    EXPECT_EQ(lens_text(again), text) << name;
    const Lens lens(model, size_px), lens_again(again, size_px);
    for (const glm::dvec3& p : {glm::dvec3(0.1, -0.2, 1), glm::dvec3(-0.7, 0.3, 0.4)})
      EXPECT_EQ(lens_again.project(p), lens.project(p)) << name << ": " << text;
  }
}

constexpr const char* kalibr_text = R"(cam0:
  camera_model: pinhole
  intrinsics: [300, 310, 2, 1]
  distortion_model: equidistant
  distortion_coeffs: [0.1, 0.01, 0.001, 0.0001]
  resolution: [4, 3]
  T_cam_imu: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
cam1:
  camera_model: pinhole
  intrinsics: [400, 410, 2, 1]
  distortion_model: none
  distortion_coeffs: []
  resolution: [8, 6]
  T_cn_cnm1: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
)";

// Error message for a camera file with a lens from that calibration, or with its image size.
std::string said_of_calibrated(const std::string& lens, const std::string& more = "") {
  const TemporaryFolder folder;
  std::ofstream(folder / "chain.yaml") << kalibr_text;
  try {
    const CameraSpec camera = parse_camera(
        "groundray_camera: 1\nmodel: m\nlens: {" + lens + "}\n" + more, folder / "mine.yaml");
    return fmt::format("{} x {}, model {}", camera.size_px.x, camera.size_px.y,
                       camera.lens.index());
  } catch (const Error& error) {
    return error.what();
  }
}

TEST(CameraFile, ReadsItsLensFromACalibration) {
  EXPECT_EQ(said_of_calibrated("calibration: chain.yaml, camera: cam0"), "4 x 3, model 2");
  EXPECT_EQ(said_of_calibrated("calibration: chain.yaml, camera: cam1"), "8 x 6, model 0");
  EXPECT_EQ(said_of_calibrated("calibration: chain.yaml, camera: cam1", "size_px: [8, 6]"),
            "8 x 6, model 0");
  EXPECT_THAT(said_of_calibrated("calibration: chain.yaml, camera: cam1", "size_px: [8, 5]"),
              HasSubstr("key 'size_px': is [8, 5], but the calibration is of images of 8 x 6"));
  EXPECT_THAT(said_of_calibrated("calibration: chain.yaml"),
              HasSubstr("mine.yaml:3:21: key 'calibration': has 2 cameras: choose one with "
                        "'camera': cam0, cam1"));
  EXPECT_THAT(said_of_calibrated("calibration: chain.yaml, camera: cam2"),
              HasSubstr("key 'camera': is 'cam2', but the calibration has cam0, cam1; did you mean "
                        "'cam0' or 'cam1'?"));
  EXPECT_THAT(said_of_calibrated("calibration: chian.yaml, camera: cam0"),
              AllOf(HasSubstr("key 'calibration': cannot be read:"), HasSubstr("chian.yaml")));
}

// A pinhole's focal length is that of its pixels; for lenses with unequal axes it is the mean.
TEST(CameraFile, DefaultFocalLengthIsThatOfTheLens) {
  const std::string text = with(camera_text, ", focal_length_mm: 6", "");
  EXPECT_NEAR(parse(text).aperture->focal_length_m, std::sqrt(200. * 210.) * 3.45e-6, 1e-10);
  const std::string fisheye = with(with(text, "brown_conrady", "kannala_brandt"),
                                   "[-0.1, 0.02, 0.001, -0.002, 0.003]", "[0.1, 0, 0, 0]");
  EXPECT_NEAR(parse(fisheye).aperture->focal_length_m, std::sqrt(200. * 210.) * 3.45e-6, 1e-10);
}

TEST(CameraFile, RejectsInvalidCameras) {
  EXPECT_THAT(complaint("focal_px: [200, 210]", "focal_px: [0, 210]"),
              HasSubstr("mine.yaml:6:16: key 'focal_px': is 0, but must be > 0"));
  EXPECT_THAT(complaint("exposure_ms: 4", "exposure_ms: 0"),
              HasSubstr("mine.yaml:11:24: key 'exposure_ms': is 0, but must be > 0"));
  EXPECT_THAT(complaint("exposure_ms: 4", "exposure_ms: -4"), HasSubstr("is -4, but must be > 0"));
  EXPECT_THAT(complaint("row_us: 15", "row_us: -15"), HasSubstr("key 'row_us': is -15"));
  EXPECT_THAT(complaint("[4, 3]", "[0, 3]"),
              HasSubstr("mine.yaml:3:11: key 'size_px': is 0, but must be > 0"));
  EXPECT_THAT(complaint("[4, 3]", "[4.5, 3]"), HasSubstr("must be whole numbers of pixels"));
  EXPECT_THAT(complaint("[4, 3]", "[40000, 25000]"),
              AllOf(HasSubstr("mine.yaml:3:10: key 'size_px': is [40000, 25000], but an image has "
                              "at most 268435456 pixels"),
                    HasSubstr("would take 67.1 GiB")));  // 1e9 rays of 9 doubles
  EXPECT_THAT(complaint("rate_hz: 25", "rate_hz: 0"), HasSubstr("key 'rate_hz': is 0"));
  EXPECT_THAT(complaint("rate_hz: 25", "rate_hz: 300"),
              HasSubstr("key 'shutter': exposes for 4 ms, but an image begins every 3.33333 ms"));
  EXPECT_THAT(complaint("f_number: 2.8", "f_number: 0"), HasSubstr("key 'f_number': is 0"));
  EXPECT_THAT(complaint("focus_m: 10", "focus_m: 0.005"),
              HasSubstr("the camera is invalid: camera"));
  EXPECT_THAT(complaint("samples: 32", "samples: 33"),
              HasSubstr("key 'samples': is 33, but must be a power of 2: 32 or 64"));
  EXPECT_THAT(complaint("most_samples: 256", "most_samples: 16"),
              HasSubstr("key 'most_samples': is 16, but must be at least the 32 of samples"));
  EXPECT_THAT(complaint("depth: 5", "depth: 65"), HasSubstr("key 'depth': is 65"));
}

TEST(CameraFile, RejectsInvalidImagers) {
  EXPECT_THAT(complaint("pixel_pitch_um: 3.45", "pixel_pitch_um: 0"),
              HasSubstr("key 'pixel_pitch_um': is 0, but must be > 0"));
  EXPECT_THAT(complaint("filter: grbg", "filter: rgbg"),
              HasSubstr("must be one of mono, rggb, bggr, grbg, gbrg; did you mean"));
  EXPECT_THAT(complaint("[0.4, 0.5, 0.3]", "[0.4, 4.5, 0.3]"),
              HasSubstr("key 'quantum_efficiency': is 4.5, but must be > 0 and at most 4"));
  EXPECT_THAT(complaint("  full_well_e: 12000\n", ""), HasSubstr("key 'full_well_e': missing"));
  EXPECT_THAT(complaint("bits: 14", "bits: 7"), HasSubstr("key 'bits': is 7, but must be from 8"));
  EXPECT_THAT(complaint("bits: 16, gains", "bits: 12, gains"),
              HasSubstr("key 'bits': is 12, but must be 8 or 16"));
  EXPECT_THAT(complaint("noise: off", "noise: no"), HasSubstr("must be one of on, off"));
}

TEST(CameraFile, RejectsInconsistentParts) {
  const std::string_view all = camera_text;
  const auto begin = all.find("imager:"), end = all.find("picture:");
  const std::string bare = with(camera_text, all.substr(begin, end - begin), "");
  EXPECT_THAT(complaint_of(bare),
              AllOf(HasSubstr("key 'products': has 'raw', which needs an 'imager'"),
                    HasSubstr("key 'products': has 'picture', which needs an 'imager'")));
  EXPECT_THAT(complaint_of(with(with(bare, "raw, picture, ", ""), " focal_length_mm: 6,", "")),
              HasSubstr("the aperture needs focal_length_mm, or an imager"));
  const auto aperture = all.find("aperture:"), sampling = all.find("sampling:");
  EXPECT_THAT(complaint(all.substr(aperture, sampling - aperture), ""),
              HasSubstr("key 'imager': needs an 'aperture'"));
}

TEST(CameraFile, ReportsFaultsInLists) {
  EXPECT_THAT(
      complaint("[raw, picture", "[raw, pictrue"),
      HasSubstr("key 'products': has 'pictrue', but may have radiance, truth, bound, "
                "flow, flow_flo, flow_kitti, boxes, coverage, irradiance, photons, electrons, raw, "
                "picture; did you mean 'picture'?"));
  EXPECT_THAT(complaint("[raw, picture", "[raw, raw"), HasSubstr("has 'raw' twice"));
  EXPECT_THAT(complaint("[raw, picture, truth, flow_kitti]", "[]"), HasSubstr("an empty list"));
}

TEST(CameraFile, ReportsFaultsInLenses) {
  EXPECT_THAT(complaint("brown_conrady:", "brown_conrad:"),
              AllOf(HasSubstr("mine.yaml:5:3: key 'brown_conrad': unknown; did you mean "
                              "'brown_conrady'?"),
                    Not(HasSubstr("exactly one"))));
  EXPECT_THAT(complaint("  brown_conrady:", "  equirectangular: {}\n  brown_conrady:"),
              HasSubstr("key 'lens': has 2 models, but must have exactly one of pinhole"));
  EXPECT_THAT(complaint(", 0.003]", ", 0.003, 0.1]"),
              HasSubstr("mine.yaml:8:19: key 'coefficients': has 6 numbers, but its model has k1 "
                        "k2 p1 p2 [k3"));
  EXPECT_THAT(complaint("[-0.1, 0.02, 0.001, -0.002, 0.003]", "-0.1"),
              HasSubstr("key 'coefficients': is '-0.1', but must be a list"));
  const auto complaint_of_lens = [](const std::string& lens) -> std::string {
    try {
      lens_of(lens);
    } catch (const Error& error) {
      return error.what();
    }
    return "no complaint";
  };
  EXPECT_THAT(complaint_of_lens("eucm: {focal_px: [1, 1], centre_px: [1, 1], alpha: 2, beta: 1}"),
              HasSubstr("key 'alpha': is 2, but must be from 0 to 1"));
  EXPECT_THAT(complaint_of_lens("f_theta: {centre_px: [1, 1], polynomial: pixels_to_angle, "
                                "coefficients: [-1]}"),
              HasSubstr("its polynomial must increase at 0"));
  EXPECT_THAT(complaint_of_lens("{}"), HasSubstr("key 'lens': has 0 models"));
}

TEST(CameraFile, LidarAndCameraFilesAreDistinguished) {
  EXPECT_EQ(complaint_of(lidar_text),
            "mine.yaml:1:18: key 'groundray_lidar': this is a lidar, not a camera: name it under "
            "'lidars'");
  EXPECT_THAT([] { parse_lidar(camera_text, "mine.yaml"); },
              ::testing::ThrowsMessage<Error>(
                  "mine.yaml:1:19: key 'groundray_camera': this is a camera, not a lidar: name it "
                  "under 'cameras'"));
}

TEST(CameraFile, ReportsAMissingFile) {
  EXPECT_THAT([] { load_camera("none.yaml"); },
              ::testing::ThrowsMessage<Error>(HasSubstr("none.yaml: there is no such file")));
  EXPECT_THAT(complaint_of("a: [1"), StartsWith("mine.yaml:"));
}

}  // namespace
}  // namespace groundray::camera_reader_test
