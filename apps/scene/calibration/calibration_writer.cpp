#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <variant>

#include "apps/scene/calibration/calibration_reader.h"
#include "apps/scene/calibration/camera_calibration.h"
#include "core/error.h"
#include "core/io/text_lines.h"
#include "core/math.h"
#include "sensors/camera/lens/lens.h"

namespace groundray {
namespace {

namespace kind = yaml::calibration::kind;

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

// Lens model in a format: its name there, and the number of its coefficients.
struct FormatModel {
  std::size_t model;
  std::size_t coefficients;
  std::string_view name;
};
// A lens has the first model whose coefficients include all of its own that are not 0.
constexpr FormatModel ros_models[] = {{kind::pinhole, 5, "plumb_bob"},
                                      {kind::brown_conrady, 5, "plumb_bob"},
                                      {kind::brown_conrady, 8, "rational_polynomial"},
                                      {kind::kannala_brandt, 4, "equidistant"}};
constexpr FormatModel opencv_models[] = {{kind::pinhole, 5, ""},
                                         {kind::brown_conrady, 4, ""},
                                         {kind::brown_conrady, 5, ""},
                                         {kind::brown_conrady, 8, ""},
                                         {kind::brown_conrady, 12, ""},
                                         {kind::brown_conrady, 14, ""},
                                         {kind::kannala_brandt, 4, "fisheye_model"},
                                         {kind::mei, 4, "xi"}};
constexpr FormatModel kalibr_models[] = {{kind::pinhole, 0, "pinhole"},
                                         {kind::brown_conrady, 4, "pinhole"},
                                         {kind::kannala_brandt, 4, "pinhole"},
                                         {kind::mei, 4, "omni"},
                                         {kind::eucm, 0, "eucm"},
                                         {kind::double_sphere, 0, "ds"}};
constexpr FormatModel colmap_models_written[] = {{kind::equirectangular, 0, "EQUIRECTANGULAR"},
                                                 {kind::pinhole, 0, "PINHOLE"},
                                                 {kind::brown_conrady, 4, "OPENCV"},
                                                 {kind::brown_conrady, 8, "FULL_OPENCV"},
                                                 {kind::kannala_brandt, 4, "OPENCV_FISHEYE"},
                                                 {kind::eucm, 0, "EUCM"}};
constexpr FormatModel basalt_models[] = {{kind::pinhole, 0, "pinhole"},
                                         {kind::brown_conrady, 8, "pinhole-radtan8"},
                                         {kind::kannala_brandt, 4, "kb4"},
                                         {kind::eucm, 0, "eucm"},
                                         {kind::double_sphere, 0, "ds"}};

struct Format {
  const char* name;
  std::span<const FormatModel> models;
  const char* supported;
  // Contents that the format can represent: several cameras, X_IC, X_FC, time shift.
  bool many = false, poses = false, relative_poses = false, shift = false;
};
constexpr const char* opencv_supports =
    "a pinhole, all of Brown and Conrady, Kannala and Brandt, Mei";
// In the order of CalibrationFormat.
constexpr Format formats[] = {
    {"ROS", ros_models,
     "a pinhole, the first 8 coefficients of Brown and Conrady, Kannala and Brandt"},
    {"OpenCV", opencv_models, opencv_supports},
    {"OpenCV", opencv_models, opencv_supports},
    {"Kalibr", kalibr_models,
     "a pinhole, k1 k2 p1 p2 of Brown and Conrady, Kannala and Brandt, Mei, EUCM, double sphere",
     true, true, true, true},
    {"COLMAP", colmap_models_written,
     "a pinhole, the first 8 coefficients of Brown and Conrady, Kannala and Brandt, EUCM, "
     "equirectangular",
     true},
    {"basalt", basalt_models,
     "a pinhole, the first 8 coefficients of Brown and Conrady, Kannala and Brandt, EUCM, double "
     "sphere",
     true, true}};
const Format& format_of(CalibrationFormat format) {
  return formats[static_cast<std::size_t>(format)];
}

// Lens in a format.
struct FormatLens {
  std::string_view model;
  std::vector<double> coefficients;  // distortion coefficients
  std::vector<double> shape;         // further parameters of the model
  std::vector<double> pinhole;       // focal lengths and centre; none without a PixelScale
};

const PixelScale* scale_of(const LensModel& model) {
  return std::visit(
      []<typename Model>(const Model& lens) -> const PixelScale* {
        if constexpr (requires { lens.scale; }) return &lens.scale;
        return nullptr;
      },
      model);
}

std::optional<FormatLens> lens_in(CalibrationFormat format, const LensModel& lens) {
  FormatLens result;
  std::visit(
      [&](const auto& model) {
        if constexpr (requires { model.xi; }) result.shape.push_back(model.xi);
        if constexpr (requires { model.alpha; }) result.shape.push_back(model.alpha);
        if constexpr (requires { model.beta; }) result.shape.push_back(model.beta);
        if constexpr (requires {
                        model.scale;
                        model.k;
                      })
          result.coefficients.assign(model.k.begin(), model.k.end());
      },
      lens);
  if (const PixelScale* scale = scale_of(lens))
    result.pinhole = {scale->focal_px.x, scale->focal_px.y, scale->centre_px.x, scale->centre_px.y};
  std::vector<double>& k = result.coefficients;
  const auto used = static_cast<std::size_t>(
      k.rend() - std::find_if(k.rbegin(), k.rend(), [](double value) { return value != 0; }));
  for (const FormatModel& known : format_of(format).models) {
    if (known.model != lens.index() || used > known.coefficients) continue;
    k.resize(known.coefficients);
    result.model = known.name;
    return result;
  }
  return std::nullopt;
}

std::vector<double> joined(std::vector<double> values, const std::vector<double>& more) {
  values.insert(values.end(), more.begin(), more.end());
  return values;
}

void check_calibrations(std::span<const CameraCalibration> cameras, CalibrationFormat kind) {
  const Format& format = format_of(kind);
  Violations broken(fmt::format("cameras to write for {}", format.name));
  broken.unless(!cameras.empty(), "there must be at least one");
  broken.unless(format.many || cameras.size() <= 1, "a file contains one camera, not {}",
                cameras.size());
  for (const CameraCalibration& camera : cameras) {
    const PixelScale* scale = scale_of(camera.model);
    const bool keeps_skew =
        format.models.data() == opencv_models && std::holds_alternative<Mei>(camera.model);
    broken.unless(lens_in(kind, camera.model).has_value(), "{}: its lens is not supported, only {}",
                  camera.name, format.supported);
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
  const FormatLens lens = *lens_in(CalibrationFormat::RosYaml, camera.model);
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

// Returns the file of a camera in OpenCV's terms.
// @param entry  returns the text of a number with its name.
// @param matrix  returns the text of a matrix: name, rows, columns and data.
template <typename Entry, typename Matrix>
std::string opencv_text(const CameraCalibration& camera, const Entry& entry, const Matrix& matrix) {
  const FormatLens lens = *lens_in(CalibrationFormat::OpenCvYaml, camera.model);
  std::string text = entry("image_width", fmt::format("{}", camera.size_px.x)) +
                     entry("image_height", fmt::format("{}", camera.size_px.y));
  if (!lens.model.empty())
    text += entry(lens.model, lens.model == "xi" ? real(lens.shape[0]) : "1");
  return text + matrix("camera_matrix", 3, 3, matrix_of(*scale_of(camera.model))) +
         matrix("distortion_coefficients", 1, lens.coefficients.size(), lens.coefficients);
}

std::string opencv_yaml(const CameraCalibration& camera) {
  return "%YAML:1.0\n---\n" +
         opencv_text(
             camera,
             [](std::string_view name, const std::string& value) {
               return fmt::format("{}: {}\n", name, value);
             },
             [](const char* name, int rows, std::size_t columns, std::span<const double> data) {
               return fmt::format(
                   "{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n",
                   name, rows, columns, reals(data));
             });
}

std::string opencv_xml(const CameraCalibration& camera) {
  return "<?xml version=\"1.0\"?>\n<opencv_storage>\n" +
         opencv_text(
             camera,
             [](std::string_view name, const std::string& value) {
               return fmt::format("<{0}>{1}</{0}>\n", name, value);
             },
             [](const char* name, int rows, std::size_t columns, std::span<const double> data) {
               return fmt::format(
                   "<{0} type_id=\"opencv-matrix\">\n  <rows>{1}</rows>\n  <cols>{2}</cols>\n"
                   "  <dt>d</dt>\n  <data>\n    {3}</data></{0}>\n",
                   name, rows, columns, reals(data, " "));
             }) +
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
    const FormatLens lens = *lens_in(CalibrationFormat::KalibrYaml, camera.model);
    const bool fisheye = std::holds_alternative<KannalaBrandt>(camera.model);
    text += fmt::format(
        "cam{}:\n  camera_model: {}\n  intrinsics: [{}]\n  distortion_model: {}\n"
        "  distortion_coeffs: [{}]\n  resolution: [{}, {}]\n",
        i, lens.model, reals(joined(lens.shape, lens.pinhole)),
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
    const FormatLens lens = *lens_in(CalibrationFormat::ColmapText, cameras[i].model);
    const glm::ivec2 size_px = cameras[i].size_px;
    std::vector<double> parameters = joined(joined(lens.pinhole, lens.coefficients), lens.shape);
    if (lens.pinhole.empty()) parameters = {1.0 * size_px.x, 1.0 * size_px.y};
    for (std::size_t k = 2; k < lens.pinhole.size(); ++k) parameters[k] += 0.5;
    const bool numbered = number_of<unsigned>(cameras[i].name).has_value();
    text += fmt::format("{} {} {} {} {}\n", numbered ? cameras[i].name : fmt::format("{}", i + 1),
                        lens.model, size_px.x, size_px.y, reals(parameters, " "));
  }
  return text;
}

std::string basalt_text(std::span<const CameraCalibration> cameras) {
  std::vector<std::string> poses, lenses, sizes;
  for (const CameraCalibration& camera : cameras) {
    const FormatLens lens = *lens_in(CalibrationFormat::BasaltJson, camera.model);
    std::vector<std::string_view> keys{"fx", "fy", "cx", "cy"};
    std::vector<double> values = joined(joined(lens.pinhole, lens.shape), lens.coefficients);
    if (lens.model == "ds") keys.insert(keys.end(), {"xi", "alpha"});
    if (lens.model == "eucm") keys.insert(keys.end(), {"alpha", "beta"});
    if (lens.model == "kb4") keys.insert(keys.end(), {"k1", "k2", "k3", "k4"});
    if (lens.model == "pinhole-radtan8") {
      keys.insert(keys.end(), {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "rpmax"});
      // Radius of the first fold.
      const Lens known(camera.model, camera.size_px);
      double limit_rad = known.limit_rad(0);
      for (int i = 1; i < 360; ++i) limit_rad = std::min(limit_rad, known.limit_rad(i * 0.01745));
      values.push_back(math::tan(limit_rad));
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
