#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <iterator>

#include "apps/scene/calibration/camera_calibration.h"
#include "core/error.h"
#include "core/io/text_lines.h"
#include "sensors/camera/lens/lens.h"

namespace groundray {
namespace {

// Formats a number so that every reader takes it for a real number.
std::string real(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string reals(std::span<const double> values, std::string_view between = ", ") {
  std::vector<std::string> words;
  for (const double value : values) words.push_back(real(value));
  return fmt::format("{}", fmt::join(words, between));
}

// Quotes a text for YAML; line breaks become blanks.
std::string in_quotes(std::string_view text) {
  std::string inside;
  for (const char c : text) inside += c == '\'' ? "''" : std::string(1, c == '\n' ? ' ' : c);
  return fmt::format("'{}'", inside);
}

// Representation of a lens in a format.
struct Spoken {
  std::string_view model;
  std::vector<double> intrinsics;    // in the format's order, with further parameters of the model
  std::vector<double> coefficients;  // distortion coefficients
};
using SpokenLens = std::optional<Spoken>;

const PixelScale* scale_of(const LensModel& model) {
  return std::visit(
      []<typename Model>(const Model& kind) -> const PixelScale* {
        if constexpr (requires { kind.scale; }) return &kind.scale;
        return nullptr;
      },
      model);
}

// Returns the number of leading coefficients after which all are 0, in OpenCV's order.
std::size_t used(const BrownConrady& model) {
  const auto last = std::find_if(model.k.rbegin(), model.k.rend(), [](double k) { return k != 0; });
  return static_cast<std::size_t>(std::distance(last, model.k.rend()));
}

std::vector<double> first(const BrownConrady& model, std::size_t count) {
  return {model.k.begin(), model.k.begin() + static_cast<std::ptrdiff_t>(count)};
}

std::vector<double> all(const std::array<double, 4>& k) { return {k.begin(), k.end()}; }

SpokenLens in_ros(const LensModel& model) {
  if (std::holds_alternative<Pinhole>(model)) return Spoken{"plumb_bob", {}, {0, 0, 0, 0, 0}};
  if (const auto* brown = std::get_if<BrownConrady>(&model)) {
    if (used(*brown) <= 5) return Spoken{"plumb_bob", {}, first(*brown, 5)};
    if (used(*brown) <= 8) return Spoken{"rational_polynomial", {}, first(*brown, 8)};
  }
  if (const auto* fisheye = std::get_if<KannalaBrandt>(&model))
    return Spoken{"equidistant", {}, all(fisheye->k)};
  return std::nullopt;
}

SpokenLens in_opencv(const LensModel& model) {
  if (std::holds_alternative<Pinhole>(model)) return Spoken{"", {}, {0, 0, 0, 0, 0}};
  if (const auto* brown = std::get_if<BrownConrady>(&model)) {
    for (const std::size_t count : {4u, 5u, 8u, 12u, 14u})
      if (used(*brown) <= count) return Spoken{"", {}, first(*brown, count)};
  }
  if (const auto* fisheye = std::get_if<KannalaBrandt>(&model))
    return Spoken{"fisheye_model", {1}, all(fisheye->k)};
  if (const auto* mei = std::get_if<Mei>(&model)) return Spoken{"xi", {mei->xi}, all(mei->k)};
  return std::nullopt;
}

SpokenLens in_kalibr(const LensModel& model) {
  const PixelScale* scale = scale_of(model);
  if (!scale) return std::nullopt;
  const glm::dvec2 f = scale->focal_px, c = scale->centre_px;
  if (std::holds_alternative<Pinhole>(model)) return Spoken{"pinhole", {f.x, f.y, c.x, c.y}, {}};
  if (const auto* brown = std::get_if<BrownConrady>(&model); brown && used(*brown) <= 4)
    return Spoken{"pinhole", {f.x, f.y, c.x, c.y}, first(*brown, 4)};
  if (const auto* fisheye = std::get_if<KannalaBrandt>(&model))
    return Spoken{"pinhole", {f.x, f.y, c.x, c.y}, all(fisheye->k)};
  if (const auto* mei = std::get_if<Mei>(&model))
    return Spoken{"omni", {mei->xi, f.x, f.y, c.x, c.y}, all(mei->k)};
  if (const auto* eucm = std::get_if<Eucm>(&model))
    return Spoken{"eucm", {eucm->alpha, eucm->beta, f.x, f.y, c.x, c.y}, {}};
  if (const auto* sphere = std::get_if<DoubleSphere>(&model))
    return Spoken{"ds", {sphere->xi, sphere->alpha, f.x, f.y, c.x, c.y}, {}};
  return std::nullopt;
}

SpokenLens in_colmap(const LensModel& model) {
  if (const auto* all_round = std::get_if<Equirectangular>(&model))
    return Spoken{"EQUIRECTANGULAR", {all_round->size_px.x, all_round->size_px.y}, {}};
  const PixelScale* scale = scale_of(model);
  if (!scale) return std::nullopt;
  const glm::dvec2 c = scale->centre_px + 0.5;
  const std::vector<double> pinhole{scale->focal_px.x, scale->focal_px.y, c.x, c.y};
  if (std::holds_alternative<Pinhole>(model)) return Spoken{"PINHOLE", pinhole, {}};
  if (const auto* brown = std::get_if<BrownConrady>(&model)) {
    if (used(*brown) <= 4) return Spoken{"OPENCV", pinhole, first(*brown, 4)};
    if (used(*brown) <= 8) return Spoken{"FULL_OPENCV", pinhole, first(*brown, 8)};
  }
  if (const auto* fisheye = std::get_if<KannalaBrandt>(&model))
    return Spoken{"OPENCV_FISHEYE", pinhole, all(fisheye->k)};
  if (const auto* eucm = std::get_if<Eucm>(&model))
    return Spoken{"EUCM", pinhole, {eucm->alpha, eucm->beta}};
  return std::nullopt;
}

SpokenLens in_basalt(const LensModel& model) {
  const PixelScale* scale = scale_of(model);
  if (!scale) return std::nullopt;
  const std::vector<double> pinhole{scale->focal_px.x, scale->focal_px.y, scale->centre_px.x,
                                    scale->centre_px.y};
  if (std::holds_alternative<Pinhole>(model)) return Spoken{"pinhole", pinhole, {}};
  if (const auto* brown = std::get_if<BrownConrady>(&model); brown && used(*brown) <= 8)
    return Spoken{"pinhole-radtan8", pinhole, first(*brown, 8)};
  if (const auto* fisheye = std::get_if<KannalaBrandt>(&model))
    return Spoken{"kb4", pinhole, all(fisheye->k)};
  if (const auto* eucm = std::get_if<Eucm>(&model))
    return Spoken{"eucm", pinhole, {eucm->alpha, eucm->beta}};
  if (const auto* sphere = std::get_if<DoubleSphere>(&model))
    return Spoken{"ds", pinhole, {sphere->xi, sphere->alpha}};
  return std::nullopt;
}

struct Format {
  const char* name;
  SpokenLens (*say)(const LensModel& model);
  const char* models;
  // Contents that the format can represent: several cameras, X_IC, X_FC, time shift.
  bool many = false, poses = false, relative_poses = false, shift = false;
};

Format format_of(CalibrationFormat format) {
  constexpr const char* opencv_models =
      "a pinhole, all of Brown and Conrady, Kannala and Brandt, Mei";
  switch (format) {
    case CalibrationFormat::RosYaml:
      return {"ROS", in_ros,
              "a pinhole, the first 8 coefficients of Brown and Conrady, Kannala and Brandt"};
    case CalibrationFormat::OpenCvYaml:
    case CalibrationFormat::OpenCvXml:
      return {"OpenCV", in_opencv, opencv_models};
    case CalibrationFormat::KalibrYaml:
      return {"Kalibr",
              in_kalibr,
              "a pinhole, k1 k2 p1 p2 of Brown and Conrady, Kannala and Brandt, Mei, EUCM, double "
              "sphere",
              true,
              true,
              true,
              true};
    case CalibrationFormat::ColmapText:
      return {"COLMAP", in_colmap,
              "a pinhole, the first 8 coefficients of Brown and Conrady, Kannala and Brandt, EUCM, "
              "equirectangular",
              true};
    case CalibrationFormat::BasaltJson:
      break;
  }
  return {"basalt", in_basalt,
          "a pinhole, the first 8 coefficients of Brown and Conrady, Kannala and Brandt, EUCM, "
          "double sphere",
          true, true};
}

void check_calibrations(std::span<const CameraCalibration> cameras, CalibrationFormat kind) {
  const Format format = format_of(kind);
  Violations broken(fmt::format("cameras to write for {}", format.name));
  broken.unless(!cameras.empty(), "there must be at least one");
  broken.unless(format.many || cameras.size() <= 1, "a file contains one camera, not {}",
                cameras.size());
  for (const CameraCalibration& camera : cameras) {
    const PixelScale* scale = scale_of(camera.model);
    const bool keeps_skew = format.say == in_opencv && std::holds_alternative<Mei>(camera.model);
    broken.unless(format.say(camera.model).has_value(), "{}: its lens is not supported, only {}",
                  camera.name, format.models);
    broken.unless(!scale || scale->skew == 0 || keeps_skew, "{}: its skew is not supported",
                  camera.name);
    broken.unless(camera.size_px.x > 0 && camera.size_px.y > 0, "{}: its size_px is missing",
                  camera.name);
    broken.unless(format.poses || !camera.X_IC, "{}: its pose is not supported: reset X_IC",
                  camera.name);
    broken.unless(format.relative_poses || !camera.X_FC,
                  "{}: its pose in the first camera is not supported: reset X_FC", camera.name);
    broken.unless(format.shift || camera.time_shift_s == 0, "{}: its time_shift_s is not supported",
                  camera.name);
    broken.unless(kind == CalibrationFormat::RosYaml || !camera.rectification,
                  "{}: its rectification is not supported: reset it", camera.name);
    broken.unless(kind != CalibrationFormat::BasaltJson || camera.X_IC, "{}: X_IC is missing",
                  camera.name);
  }
  if (kind == CalibrationFormat::KalibrYaml && !cameras.empty()) {
    const auto placed = static_cast<std::size_t>(std::ranges::count_if(
        cameras, [](const CameraCalibration& camera) { return camera.X_FC.has_value(); }));
    broken.unless(placed == 0 || placed == cameras.size(),
                  "{} of {} cameras have X_FC, but all or none must have it", placed,
                  cameras.size());
    broken.unless(placed == 0 || *cameras[0].X_FC == Pose{},
                  "{}: X_FC of the first camera must be the identity", cameras[0].name);
  }
  broken.throw_if_any();
}

std::array<double, 9> matrix_of(const glm::dmat3& m) {
  return {m[0][0], m[1][0], m[2][0], m[0][1], m[1][1], m[2][1], m[0][2], m[1][2], m[2][2]};
}

std::array<double, 9> matrix_of(const PixelScale& s) {
  return {
      s.focal_px.x, s.skew * s.focal_px.x, s.centre_px.x, 0, s.focal_px.y, s.centre_px.y, 0, 0, 1};
}

std::string ros_text(const CameraCalibration& camera) {
  const PixelScale& s = *scale_of(camera.model);
  const Spoken lens = *in_ros(camera.model);
  const Rectification rectified = camera.rectification.value_or(Rectification{.scale = s});
  const glm::dvec2 f = rectified.scale.focal_px, c = rectified.scale.centre_px;
  const std::array<double, 12> projection{
      f.x, 0, c.x, 0 - f.x * rectified.offset_m, 0, f.y, c.y, 0, 0, 0, 1, 0};
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_name: {}\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\n"
      "distortion_model: {}\n"
      "distortion_coefficients:\n  rows: 1\n  cols: {}\n  data: [{}]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{}]\n",
      camera.size_px.x, camera.size_px.y, in_quotes(camera.name), reals(matrix_of(s)), lens.model,
      lens.coefficients.size(), reals(lens.coefficients),
      reals(matrix_of(glm::mat3_cast(rectified.R_RC))), reals(projection));
}

std::string opencv_yaml(const CameraCalibration& camera) {
  const Spoken lens = *in_opencv(camera.model);
  const auto matrix = [](const char* name, std::size_t rows, std::size_t columns,
                         std::span<const double> data) {
    return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n",
                       name, rows, columns, reals(data));
  };
  return fmt::format("%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n", camera.size_px.x,
                     camera.size_px.y) +
         (lens.model.empty() ? ""
                             : fmt::format("{}: {}\n", lens.model,
                                           lens.model == "xi" ? real(lens.intrinsics[0]) : "1")) +
         matrix("camera_matrix", 3, 3, matrix_of(*scale_of(camera.model))) +
         matrix("distortion_coefficients", 1, lens.coefficients.size(), lens.coefficients);
}

std::string opencv_xml(const CameraCalibration& camera) {
  const Spoken lens = *in_opencv(camera.model);
  const auto matrix = [](const char* name, std::size_t rows, std::size_t columns,
                         std::span<const double> data) {
    return fmt::format(
        "<{0} type_id=\"opencv-matrix\">\n  <rows>{1}</rows>\n  <cols>{2}</cols>\n  <dt>d</dt>\n"
        "  <data>\n    {3}</data></{0}>\n",
        name, rows, columns, reals(data, " "));
  };
  return fmt::format(
             "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>{}</image_width>\n"
             "<image_height>{}</image_height>\n",
             camera.size_px.x, camera.size_px.y) +
         (lens.model.empty() ? ""
                             : fmt::format("<{0}>{1}</{0}>\n", lens.model,
                                           lens.model == "xi" ? real(lens.intrinsics[0]) : "1")) +
         matrix("camera_matrix", 3, 3, matrix_of(*scale_of(camera.model))) +
         matrix("distortion_coefficients", 1, lens.coefficients.size(), lens.coefficients) +
         "</opencv_storage>\n";
}

std::string rows_of(const Pose& pose) {
  const glm::dmat3 turn = glm::mat3_cast(pose.rotation);
  std::string text;
  for (int row = 0; row < 3; ++row)
    text += fmt::format("    - [{}]\n", reals(std::array{turn[0][row], turn[1][row], turn[2][row],
                                                         pose.translation_m[row]}));
  return text + "    - [0.0, 0.0, 0.0, 1.0]\n";
}

std::string kalibr_text(std::span<const CameraCalibration> cameras) {
  std::string text;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraCalibration& camera = cameras[i];
    const Spoken lens = *in_kalibr(camera.model);
    const bool fisheye = std::holds_alternative<KannalaBrandt>(camera.model);
    text += fmt::format(
        "cam{}:\n  camera_model: {}\n  intrinsics: [{}]\n  distortion_model: {}\n"
        "  distortion_coeffs: [{}]\n  resolution: [{}, {}]\n",
        i, lens.model, reals(lens.intrinsics),
        lens.coefficients.empty() ? "none" : (fisheye ? "equidistant" : "radtan"),
        reals(lens.coefficients), camera.size_px.x, camera.size_px.y);
    if (camera.X_IC) text += "  T_cam_imu:\n" + rows_of(inverse(*camera.X_IC));
    if (camera.X_FC && i > 0)
      text += "  T_cn_cnm1:\n" + rows_of(inverse(*camera.X_FC) * *cameras[i - 1].X_FC);
    if (camera.time_shift_s != 0)
      text += fmt::format("  timeshift_cam_imu: {}\n", real(camera.time_shift_s));
  }
  return text;
}

std::string colmap_text(std::span<const CameraCalibration> cameras) {
  std::string text = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    Spoken lens = *in_colmap(cameras[i].model);
    const glm::ivec2 size_px = cameras[i].size_px;
    if (lens.model == "EQUIRECTANGULAR") lens.intrinsics = {1.0 * size_px.x, 1.0 * size_px.y};
    std::ranges::copy(lens.coefficients, std::back_inserter(lens.intrinsics));
    const bool numbered = number_of<unsigned>(cameras[i].name).has_value();
    text += fmt::format("{} {} {} {} {}\n", numbered ? cameras[i].name : fmt::format("{}", i + 1),
                        lens.model, size_px.x, size_px.y, reals(lens.intrinsics, " "));
  }
  return text;
}

std::string basalt_text(std::span<const CameraCalibration> cameras) {
  std::vector<std::string> poses, lenses, sizes;
  for (const CameraCalibration& camera : cameras) {
    const Spoken lens = *in_basalt(camera.model);
    std::vector<std::string_view> keys{"fx", "fy", "cx", "cy"};
    std::vector<double> values = lens.intrinsics;
    if (lens.model == "ds") keys.insert(keys.end(), {"xi", "alpha"});
    if (lens.model == "eucm") keys.insert(keys.end(), {"alpha", "beta"});
    if (lens.model == "kb4") keys.insert(keys.end(), {"k1", "k2", "k3", "k4"});
    std::ranges::copy(lens.coefficients, std::back_inserter(values));
    if (lens.model == "pinhole-radtan8") {
      keys.insert(keys.end(), {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "rpmax"});
      // Radius of the first fold.
      const Lens known(camera.model, camera.size_px);
      double limit_rad = known.limit_rad(0);
      for (int i = 1; i < 360; ++i) limit_rad = std::min(limit_rad, known.limit_rad(i * 0.01745));
      values.push_back(std::tan(limit_rad));
    }
    std::vector<std::string> pairs;
    for (std::size_t i = 0; i < keys.size(); ++i)
      pairs.push_back(fmt::format("\"{}\": {}", keys[i], real(values[i])));
    lenses.push_back(fmt::format("{{\"camera_type\": \"{}\", \"intrinsics\": {{{}}}}}", lens.model,
                                 fmt::join(pairs, ", ")));
    const glm::dvec3& p = camera.X_IC->translation_m;
    const glm::dquat& q = camera.X_IC->rotation;
    poses.push_back(fmt::format(
        "{{\"px\": {}, \"py\": {}, \"pz\": {}, \"qx\": {}, \"qy\": {}, \"qz\": {}, \"qw\": {}}}",
        real(p.x), real(p.y), real(p.z), real(q.x), real(q.y), real(q.z), real(q.w)));
    sizes.push_back(fmt::format("[{}, {}]", camera.size_px.x, camera.size_px.y));
  }
  const auto list = [](const std::vector<std::string>& items) {
    return fmt::format("[\n      {}\n    ]", fmt::join(items, ",\n      "));
  };
  return fmt::format(
      "{{\n  \"value0\": {{\n    \"T_imu_cam\": {},\n    \"intrinsics\": {},\n    \"resolution\": "
      "{}\n  }}\n}}\n",
      list(poses), list(lenses), list(sizes));
}

}  // namespace

std::string camera_calibrations_text(std::span<const CameraCalibration> cameras,
                                     CalibrationFormat format) {
  check_calibrations(cameras, format);
  switch (format) {
    case CalibrationFormat::RosYaml:
      return ros_text(cameras[0]);
    case CalibrationFormat::OpenCvYaml:
      return opencv_yaml(cameras[0]);
    case CalibrationFormat::OpenCvXml:
      return opencv_xml(cameras[0]);
    case CalibrationFormat::KalibrYaml:
      return kalibr_text(cameras);
    case CalibrationFormat::ColmapText:
      return colmap_text(cameras);
    case CalibrationFormat::BasaltJson:
      break;
  }
  return basalt_text(cameras);
}

}  // namespace groundray
