#include "apps/dataset/write/run_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <string_view>
#include <variant>

#include "apps/dataset/frame_entry.h"
#include "apps/scene/calibration/camera_calibration.h"
#include "apps/scene/fingerprint.h"
#include "apps/scene/notes.h"
#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/math_fingerprint.h"

namespace groundray {
namespace {

// Returns a text as a double-quoted YAML scalar.
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

// Adds a lens by the directions of some pixels, because it may be in another file that the camera's
// file only names.
void add_lens(const Lens& lens, Fingerprint& print) {
  constexpr int steps = 8;
  for (int i = 0; i <= steps * steps; ++i) {
    const glm::dvec2 share(i % steps, i / steps);
    const auto ray = lens.ray(share * glm::dvec2(lens.size_px() - 1) / double{steps});
    const glm::dvec3 direction = ray ? ray->direction : glm::dvec3(0);
    print.add_all(direction.x, direction.y, direction.z);
  }
}

std::uint64_t fingerprint_of(std::span<const char> text) {
  Fingerprint print;
  print.add(text);
  return print.value();
}

std::uint64_t fingerprint_of(const PlacedLidar& lidar) {
  Fingerprint print;
  print.add(std::span(lidar.X_DS.samples()));
  print.add(std::span<const char>(calibration_text(lidar)));
  if (const auto* table = std::get_if<TablePattern>(&lidar.spec.lidar.pattern)) {
    for (const auto& [time_s, azimuth_rad, elevation_rad, ring, origin_m] : table->shots) {
      const std::array numbers{time_s, azimuth_rad, elevation_rad};
      print.add(std::span<const double>(numbers));
      print.add(std::span<const std::uint16_t>(&ring, 1));
    }
  }
  return print.value();
}

std::uint64_t fingerprint_of(const PlacedCamera& camera) {
  Fingerprint print;
  print.add(std::span(camera.X_DC.samples()));
  print.add(std::span<const char>(calibration_text(camera)));
  add_lens(camera.camera.lens(), print);
  return print.value();
}

std::uint64_t fingerprint(const Simulation& simulation) {
  Fingerprint print;
  for (const RunInput& input : run_inputs(simulation)) print.add_all(input.fingerprint);
  return print.value();
}

std::string world_text(const SceneSpec& spec) {
  if (!spec.world) return "";
  return fmt::format("world: {}\ndrawn: {}\n", spec.world->number, spec.world->drawn);
}

std::string classes_text(const SceneSpec& spec) {
  if (spec.classes.empty()) return "";
  std::vector<std::string> entries;
  for (const auto& [label, name] : spec.classes)
    entries.push_back(fmt::format("{}: {}", label, name));
  return fmt::format("classes: {{{}}}\n", fmt::join(entries, ", "));
}

}  // namespace

std::vector<RunInput> run_inputs(const Simulation& simulation) {
  static_assert(sizeof(Trajectory::Sample) == 8 * sizeof(double),
                "no padding, whose bytes are anything");
  std::vector<RunInput> inputs{{"terrain", fingerprint_of(simulation.terrain.fingerprint())}};
  for (const PlacedLidar& lidar : simulation.lidars)
    inputs.push_back({fmt::format("lidar '{}'", lidar.spec.name), fingerprint_of(lidar)});
  for (const PlacedCamera& camera : simulation.cameras)
    inputs.push_back({fmt::format("camera '{}'", camera.spec.name), fingerprint_of(camera)});
  if (const auto& sky = simulation.spec.sky) {
    if (const auto* environment = std::get_if<EnvironmentImage>(&sky->dome))
      inputs.push_back({"sky", fingerprint_of(read_text(environment->image))});
  }
  Fingerprint materials;
  for (const Material& material : simulation.scene_objects.materials.all())
    materials.add_all(groundray::fingerprint_of(material));
  inputs.push_back({"materials", materials.value()});
  inputs.push_back({"objects", fingerprint_of(simulation.scene_objects.fingerprint)});
  return inputs;
}

std::string run_header(const Simulation& simulation, const FrameChoice& choice) {
  const glm::dvec3 origin_m = simulation.terrain.header().origin_w_m;
  std::string text = fmt::format(
      "groundray_dataset: 1\nversion: {}\nseed: {}\n{}tracing: {}\n{}functions: \"{:016x}\"\n"
      "inputs: \"{:016x}\"\ntime_origin_s: {}\n"
      "origin_w_m: [{}, {}, {}]\ncrs: "
      "{}\ncrs_wkt: {}\nscene: "
      "{}\nsensors:\n",
      yaml_text(GROUNDRAY_VERSION), simulation.spec.seed.value, world_text(simulation.spec),
      simulation.spec.tracing == Tracing::Fast ? "fast" : "exact", classes_text(simulation.spec),
      math::fingerprint(), fingerprint(simulation), seconds_text(simulation.begin), origin_m.x,
      origin_m.y, origin_m.z, yaml_text(simulation.terrain.header().crs_name),
      yaml_text(simulation.terrain.header().crs_wkt), yaml_text(simulation.spec.text));
  std::size_t number = 0;
  const auto add_sensor = [&](const auto& spec, const char* kind, const std::string& model,
                              auto frames) {
    const std::size_t own = number++;
    if (!choice.has_sensor(spec.name)) return;
    text +=
        fmt::format("  - {{name: {}, kind: {}, number: {}, model: {}, source: {}, frames: {}}}\n",
                    yaml_text(spec.name), kind, own, yaml_text(model), yaml_text(spec.source),
                    choice.count(static_cast<std::int64_t>(frames)));
  };
  for (const PlacedLidar& lidar : simulation.lidars)
    add_sensor(lidar.spec, "lidar", lidar.spec.lidar.model, lidar.sweeps);
  for (const PlacedCamera& camera : simulation.cameras)
    add_sensor(camera.spec, "camera", camera.spec.camera.model, camera.begins.size());
  for (const StereoSpec& pair : simulation.spec.stereo) {
    if (!choice.has_sensor(pair.left) || !choice.has_sensor(pair.right)) continue;
    text += fmt::format("  - {{name: {}, kind: stereo, left: {}, right: {}, images: {}}}\n",
                        yaml_text(pair.name), yaml_text(pair.left), yaml_text(pair.right),
                        pair.images == StereoSpec::Images::Rectified ? "rectified" : "as_mounted");
  }
  if (!simulation.cameras.empty()) {
    text += "materials:  # by number in images, from 1\n";
    for (const Material& material : simulation.scene_objects.materials.all())
      text += fmt::format("  - {}\n", yaml_text(material.name));
  }
  const std::vector<std::string> notes = notes_of(simulation);
  if (!notes.empty()) text += "notes:\n";
  for (const std::string& note : notes) text += fmt::format("  - {}\n", yaml_text(note));
  if (!simulation.scene_objects.groups.empty()) text += "objects:\n";
  for (const SceneObjects::Group& group : simulation.scene_objects.groups) {
    text += fmt::format("  - {{name: {}, label: {}, first_instance: {}, count: {}}}\n",
                        yaml_text(group.name), group.label, group.first, group.count);
  }
  return text;
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
