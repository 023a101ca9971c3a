#include "apps/groundray/dataset.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <span>
#include <string>
#include <string_view>

#include "apps/groundray/fingerprint.h"
#include "core/error.h"
#include "core/product_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view frames = "\nframes:\n";  // what precedes it says what run this is

double degrees(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }

// A double-quoted YAML scalar.
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

// All else is told by the text of the lidar's own file, and by the scene's.
std::string calibration(const PlacedLidar& placed) {
  const LidarSpec& lidar = placed.spec.lidar;
  const Pose& X_BS = placed.spec.X_BS;
  std::string text = fmt::format(
      "model: {}\nframe: \"x forward, y left, z up\"\nX_BS:  # pose of the sensor in the body\n  "
      "translation_m: [{}, {}, {}]\n  rotation_xyzw: [{}, {}, {}, {}]\nrange_gate_m: [{}, {}]\n"
      "range_noise_sigma_m: {}\n",
      yaml_text(lidar.model), X_BS.translation_m.x, X_BS.translation_m.y, X_BS.translation_m.z,
      X_BS.rotation.x, X_BS.rotation.y, X_BS.rotation.z, X_BS.rotation.w, lidar.gate.near_m,
      std::isinf(lidar.gate.far_m) ? ".inf" : fmt::format("{}", lidar.gate.far_m),
      lidar.range_noise_sigma_m);
  if (const auto* spinning = std::get_if<SpinningPattern>(&lidar.pattern))
    text += spinning_text(*spinning);
  return text + fmt::format("lidar_file: {}\n", yaml_text(placed.spec.text));
}

// Seconds to the nanosecond, whatever the clock's epoch.
std::string decimal_seconds(std::chrono::nanoseconds time) {
  const std::int64_t count = time.count();
  return fmt::format("{}{}.{:09}", count < 0 ? "-" : "", std::abs(count / 1'000'000'000),
                     std::abs(count % 1'000'000'000));
}

std::uint64_t fingerprint(const World& world) {
  static_assert(sizeof(Trajectory::Sample) == 8 * sizeof(double),
                "no padding, whose bytes are anything");
  Fingerprint print;
  print.add(std::span<const char>(world.terrain.fingerprint()));
  for (const PlacedLidar& lidar : world.lidars) {
    print.add(std::span(lidar.X_DS.samples()));
    print.add(std::span<const char>(calibration(lidar)));
    if (const auto* table = std::get_if<TablePattern>(&lidar.spec.lidar.pattern)) {
      for (const auto& [time_s, azimuth_rad, elevation_rad, ring, origin_m] : table->shots) {
        const std::array numbers{time_s, azimuth_rad, elevation_rad};
        print.add(std::span<const double>(numbers));
        print.add(std::span<const std::uint16_t>(&ring, 1));
      }
    }
  }
  for (const Material& material : world.content.materials.all())
    print.add_all(fingerprint_of(material));
  print.add(std::span<const char>(world.content.fingerprint));
  return print.value();
}

std::string header(const World& world) {
  const glm::dvec3 origin_m = world.terrain.header().origin_w_m;
  std::string text = fmt::format(
      "groundray_dataset: 1\nversion: {}\nseed: {}\ntracing: {}\ninputs: "
      "\"{:016x}\"\ntime_origin_s: {}\n"
      "origin_w_m: [{}, {}, {}]\ncrs: "
      "{}\ncrs_wkt: {}\nscene: "
      "{}\nsensors:\n",
      yaml_text(GROUNDRAY_VERSION), world.spec.seed.value,
      world.spec.tracing == Tracing::Fast ? "fast" : "exact", fingerprint(world),
      decimal_seconds(world.begin), origin_m.x, origin_m.y, origin_m.z,
      yaml_text(world.terrain.header().crs_name), yaml_text(world.terrain.header().crs_wkt),
      yaml_text(world.spec.text));
  for (std::size_t i = 0; i < world.lidars.size(); ++i) {
    const MountedLidar& spec = world.lidars[i].spec;
    text += fmt::format(
        "  - {{name: {}, kind: lidar, number: {}, model: {}, source: {}, frames: {}}}\n",
        yaml_text(spec.name), i, yaml_text(spec.lidar.model), yaml_text(spec.source),
        world.lidars[i].sweeps);
  }
  if (!world.content.groups.empty()) text += "objects:\n";
  for (const Content::Group& group : world.content.groups) {
    text += fmt::format("  - {{name: {}, label: {}, first_instance: {}, count: {}}}\n",
                        yaml_text(group.name), group.label, group.first, group.count);
  }
  return text;
}

// What the scan's header says of its convergence, as an entry of its frame; empty if nothing.
std::string convergence_of(const fs::path& scan) {
  std::ifstream file(scan);
  const std::string begin = fmt::format("comment {}", convergence_comment);
  for (std::string line; std::getline(file, line) && line != "end_header";) {
    if (line.starts_with(begin)) return ", convergence: " + line.substr(begin.size());
  }
  return {};
}

void make_folder(const fs::path& folder) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure) {
    throw Error("{}: cannot make this folder: {}; choose another one with -o", folder.string(),
                failure.message());
  }
}

void check_same_run(const fs::path& folder, const std::string& header) {
  std::error_code ignored;
  if (!fs::exists(folder, ignored) || fs::is_empty(folder, ignored)) return;
  const fs::path record = folder / "dataset.yaml";
  if (!fs::exists(record, ignored)) {
    throw Error(
        "{}: the folder is not empty and holds no dataset.yaml; choose a new folder with -o",
        folder.string());
  }
  const std::string before = read_text(record);
  if (before.substr(0, before.find(frames)) + "\n" != header) {
    throw Error(
        "{}: the folder holds a dataset of another scene, DEM, trajectory, sensor, seed or "
        "version; choose a new folder "
        "with -o or "
        "remove this one",
        folder.string());
  }
}

}  // namespace

Dataset::Dataset(const fs::path& folder, const World& world)
    : folder_(folder), world_(world), header_(header(world)) {
  check_same_run(folder, header_);
  make_folder(folder);
  record();  // first: a folder with it can be taken up again
  for (const char* name : {"poses", "calibration", "lidar"}) make_folder(folder / name);
  for (const PlacedLidar& lidar : world.lidars) {
    make_folder(folder / "lidar" / lidar.spec.name);
    write_tum(folder / "poses" / (lidar.spec.name + ".tum"), lidar.X_DS,
              "sensor S in D: t [s] x y z [m] qx qy qz qw");
    write_text(folder / "calibration" / (lidar.spec.name + ".yaml"), calibration(lidar));
  }
}

fs::path Dataset::product_path(const PlacedLidar& lidar, std::int64_t frame,
                               std::string_view suffix) const {
  return folder_ / "lidar" / lidar.spec.name / fmt::format("{:06}{}", frame, suffix);
}

fs::path Dataset::scan_path(const PlacedLidar& lidar, std::int64_t frame) const {
  return product_path(lidar, frame, ".ply");
}

fs::path Dataset::preview_path(const PlacedLidar& lidar, std::int64_t frame) const {
  return product_path(lidar, frame, "_preview.png");
}

bool Dataset::has(const PlacedLidar& lidar, std::int64_t frame) const {
  return fs::exists(scan_path(lidar, frame));
}

void Dataset::record() const {
  std::string text = header_;
  text.pop_back();
  text += frames;
  for (const PlacedLidar& lidar : world_.lidars) {
    for (std::int64_t frame = 0; frame < lidar.sweeps; ++frame) {
      const bool done = has(lidar, frame);
      text += fmt::format("  - {{sensor: {}, frame: {}, stamp_s: {:.9f}, state: {}{}}}\n",
                          yaml_text(lidar.spec.name), frame,
                          1e-9 * static_cast<double>(lidar.lidar.pattern().stamp(frame).count()),
                          done ? "done" : "pending",
                          done ? convergence_of(scan_path(lidar, frame)) : "");
    }
  }
  write_text(folder_ / "dataset.yaml", text);
}

}  // namespace groundray
