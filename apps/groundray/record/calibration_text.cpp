#include "apps/groundray/record/calibration_text.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <variant>

#include "apps/scene/calibration/camera_calibration.h"
#include "apps/scene/readers/spec_io.h"
#include "core/error.h"
#include "core/io/file_io.h"

namespace groundray {
namespace {

double degrees(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }

std::string pose_text(const Pose& pose) {
  const auto& [q, p_m] = pose;
  return fmt::format("  translation_m: [{}, {}, {}]\n  rotation_xyzw: [{}, {}, {}, {}]\n", p_m.x,
                     p_m.y, p_m.z, q.x, q.y, q.z, q.w);
}

std::string spinning_text(const SpinningPattern& pattern) {
  const auto& field = pattern.field_of_view;
  const std::string view = field ? fmt::format("field_of_view_deg: [{}, {}]\n",
                                               degrees(field->from_rad), degrees(field->to_rad))
                                 : "";
  std::string text = fmt::format(
      "rotation_rate_hz: {}\nsense: {}\nstart_azimuth_deg: {}\nfiring_period_us: {}\n"
      "{}beam_columns: [loop, ring, elevation_deg, azimuth_offset_deg, origin_x_m, origin_y_m, "
      "origin_z_m, firing_time_us]\nbeams:\n",
      pattern.rate_hz,
      pattern.sense == SpinningPattern::Sense::Clockwise ? "clockwise" : "counter_clockwise",
      degrees(pattern.start_azimuth_rad), pattern.firing_period_s * 1e6, view);
  for (const Beam& beam : pattern.beams) {
    text +=
        fmt::format("- [{}, {}, {:.9g}, {:.9g}, {:.9g}, {:.9g}, {:.9g}, {:.9g}]\n", beam.loop,
                    beam.ring, degrees(beam.elevation_rad), degrees(beam.azimuth_offset_rad),
                    beam.origin_m.x, beam.origin_m.y, beam.origin_m.z, beam.firing_time_s * 1e6);
  }
  return text;
}

}  // namespace

std::string yaml_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n') {
      out += "\\n";
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\x{:02x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

// Everything else is in the texts of the lidar's own file and of the scene.
std::string calibration_text(const PlacedLidar& placed) {
  const LidarSpec& lidar = placed.spec.lidar;
  std::string text = fmt::format(
      "model: {}\nframe: \"x forward, y left, z up\"\nX_BS:  # pose of the sensor in the body\n{}"
      "range_gate_m: [{}, {}]\n"
      "range_noise_sigma_m: {}\npoints: {}\n",
      yaml_text(lidar.model), pose_text(placed.spec.X_BS), lidar.gate.near_m,
      std::isinf(lidar.gate.far_m) ? ".inf" : fmt::format("{}", lidar.gate.far_m),
      lidar.range_noise_sigma_m,
      lidar.points == LidarSpec::Points::AsFired ? "as_fired" : "at_stamp");
  if (const auto* spinning = std::get_if<SpinningPattern>(&lidar.pattern))
    text += spinning_text(*spinning);
  return text + fmt::format("lidar_file: {}\n", yaml_text(placed.spec.text));
}

// As for lidars; the rectification of a stereo pair is stored nowhere else.
std::string calibration_text(const PlacedCamera& placed) {
  const CameraSpec& camera = placed.spec.camera;
  std::string text = fmt::format(
      "model: {}\nframe: \"x right, y down, z ahead; pixel centres are whole\"\nX_BC:  # pose of "
      "the camera in the body\n{}size_px: [{}, {}]\nlens: {{{}}}\nexposure_s: {}\nrow_s: {}\n",
      yaml_text(camera.model), pose_text(placed.spec.X_BC), camera.size_px.x, camera.size_px.y,
      lens_text(camera.lens), camera.shutter.exposure_s, camera.shutter.row_s);
  if (const auto& to = placed.rectification) {
    const auto& [R_RC, scale, right_of_left_m] = *to;
    const auto* pinhole = std::get_if<Pinhole>(&camera.lens);
    const bool is_done = pinhole != nullptr && R_RC == glm::dquat(1, 0, 0, 0) &&
                         pinhole->scale.focal_px == scale.focal_px &&
                         pinhole->scale.centre_px == scale.centre_px;
    text += fmt::format(
        "rectification:  # of the stereo pair; rotation: from this camera's axes to the "
        "rectified\n  state: {}\n  rotation_xyzw: [{}, {}, {}, {}]\n  focal_px: [{}, {}]\n"
        "  centre_px: [{}, {}]\n  right_of_left_m: {}\n",
        is_done ? "done" : "to_do", R_RC.x, R_RC.y, R_RC.z, R_RC.w, scale.focal_px.x,
        scale.focal_px.y, scale.centre_px.x, scale.centre_px.y, right_of_left_m);
  }
  return text + fmt::format("camera_file: {}\n", yaml_text(placed.spec.text));
}

std::vector<std::string> write_exchange_calibrations(const std::filesystem::path& stem,
                                                     const PlacedCamera& placed) {
  const CameraSpec& camera = placed.spec.camera;
  CameraCalibration calibration{.name = placed.spec.name,
                                .model = camera.lens,
                                .size_px = camera.size_px,
                                .X_IC = {},
                                .X_FC = {},
                                .time_shift_s = 0,
                                .rectification = placed.rectification};
  std::vector<std::string> written;
  const auto write = [&](const char* suffix, CalibrationFormat format) {
    std::string text;
    try {
      text = camera_calibrations_text({&calibration, 1}, format);
    } catch (const Error&) {
      return;  // the format cannot describe this lens
    }
    write_text(stem.string() + suffix, text);
    written.emplace_back(suffix);
  };
  write(".ros.yaml", CalibrationFormat::RosYaml);
  calibration.rectification.reset();  // Kalibr's files describe cameras as mounted
  write(".kalibr.yaml", CalibrationFormat::KalibrYaml);
  return written;
}

}  // namespace groundray
