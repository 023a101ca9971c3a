#include "apps/groundray/record/dataset.h"

#include <fmt/format.h>

#include <algorithm>
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

#include "apps/dataset/dataset_listing.h"
#include "apps/groundray/record/calibration_text.h"
#include "apps/groundray/record/images.h"
#include "apps/scene/fingerprint.h"
#include "core/error.h"
#include "core/product_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view frames = "\nframes:\n";  // what precedes it says what run this is

// Seconds to the nanosecond, whatever the clock's epoch.
std::string decimal_seconds(std::chrono::nanoseconds time) {
  const std::int64_t count = time.count();
  return fmt::format("{}{}.{:09}", count < 0 ? "-" : "", std::abs(count / 1'000'000'000),
                     std::abs(count % 1'000'000'000));
}

// A lens by where some pixels look: it may come from a file that the camera's only names.
void add_lens(const Lens& lens, Fingerprint& print) {
  constexpr int steps = 8;
  for (int i = 0; i <= steps * steps; ++i) {
    const glm::dvec2 share(i % steps, i / steps);
    const auto ray = lens.ray(share * glm::dvec2(lens.size_px() - 1) / double{steps});
    const glm::dvec3 direction = ray ? ray->direction : glm::dvec3(0);
    print.add_all(direction.x, direction.y, direction.z);
  }
}

std::uint64_t fingerprint(const World& world) {
  static_assert(sizeof(Trajectory::Sample) == 8 * sizeof(double),
                "no padding, whose bytes are anything");
  Fingerprint print;
  print.add(std::span<const char>(world.terrain.fingerprint()));
  for (const PlacedLidar& lidar : world.lidars) {
    print.add(std::span(lidar.X_DS.samples()));
    print.add(std::span<const char>(calibration_text(lidar)));
    if (const auto* table = std::get_if<TablePattern>(&lidar.spec.lidar.pattern)) {
      for (const auto& [time_s, azimuth_rad, elevation_rad, ring, origin_m] : table->shots) {
        const std::array numbers{time_s, azimuth_rad, elevation_rad};
        print.add(std::span<const double>(numbers));
        print.add(std::span<const std::uint16_t>(&ring, 1));
      }
    }
  }
  for (const PlacedCamera& camera : world.cameras) {
    print.add(std::span(camera.X_DC.samples()));
    print.add(std::span<const char>(calibration_text(camera)));
    add_lens(camera.camera.lens(), print);
  }
  if (const auto& sky = world.spec.sky) {
    if (const auto* environment = std::get_if<EnvironmentImage>(&sky->dome))
      print.add(std::span<const char>(read_text(environment->image)));
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
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    const MountedCamera& spec = world.cameras[i].spec;
    text += fmt::format(
        "  - {{name: {}, kind: camera, number: {}, model: {}, source: {}, frames: {}}}\n",
        yaml_text(spec.name), world.lidars.size() + i, yaml_text(spec.camera.model),
        yaml_text(spec.source), world.cameras[i].begins.size());
  }
  for (const StereoSpec& pair : world.spec.stereo) {
    text += fmt::format("  - {{name: {}, kind: stereo, left: {}, right: {}, images: {}}}\n",
                        yaml_text(pair.name), yaml_text(pair.left), yaml_text(pair.right),
                        pair.images == StereoSpec::Images::Rectified ? "rectified" : "as_mounted");
  }
  if (!world.cameras.empty()) {
    text += "materials:  # by number in images, from 1\n";
    for (const Material& material : world.content.materials.all())
      text += fmt::format("  - {}\n", yaml_text(material.name));
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
  for (const char* name : {"poses", "calibration"}) make_folder(folder / name);
  const auto write_calibration = [&](const std::string& name, const Trajectory& X_DS,
                                     const char* comment, const std::string& text) {
    write_tum(folder / "poses" / (name + ".tum"), X_DS, comment);
    write_text(folder / "calibration" / (name + ".yaml"), text);
  };
  for (const PlacedLidar& lidar : world.lidars) {
    make_folder(folder / "lidar" / lidar.spec.name);
    write_calibration(lidar.spec.name, lidar.X_DS, "sensor S in D: t [s] x y z [m] qx qy qz qw",
                      calibration_text(lidar));
  }
  for (const PlacedCamera& camera : world.cameras) {
    make_folder(folder / "camera" / camera.spec.name);
    write_calibration(camera.spec.name, camera.X_DC, "camera C in D: t [s] x y z [m] qx qy qz qw",
                      calibration_text(camera));
    write_exchange_calibrations(folder / "calibration" / camera.spec.name, camera);
  }
}

fs::path Dataset::product_path(const PlacedLidar& lidar, std::int64_t frame,
                               std::string_view suffix) const {
  return folder_ / "lidar" / lidar.spec.name / fmt::format("{:06}{}", frame, suffix);
}

fs::path Dataset::product_path(const PlacedCamera& camera, std::int64_t frame,
                               std::string_view suffix) const {
  return folder_ / "camera" / camera.spec.name / fmt::format("{:06}{}", frame, suffix);
}

bool Dataset::has(const PlacedLidar& lidar, std::int64_t frame) const {
  return fs::exists(product_path(lidar, frame, scan_suffix));
}

bool Dataset::has(const PlacedCamera& camera, std::int64_t frame) const {
  return std::ranges::all_of(image_suffixes(camera.spec), [&](const std::string& suffix) {
    return fs::exists(product_path(camera, frame, suffix));
  });
}

void Dataset::record() const {
  std::string text = header_;
  text.pop_back();
  text += frames;
  const auto add = [&](const std::string& sensor, std::int64_t frame,
                       std::chrono::nanoseconds stamp, bool is_done, const std::string& more) {
    text += fmt::format("  - {{sensor: {}, frame: {}, stamp_s: {:.9f}, state: {}{}}}\n",
                        yaml_text(sensor), frame, 1e-9 * static_cast<double>(stamp.count()),
                        is_done ? "done" : "pending", more);
  };
  for (const PlacedLidar& lidar : world_.lidars) {
    for (std::int64_t frame = 0; frame < lidar.sweeps; ++frame) {
      const bool is_done = has(lidar, frame);
      add(lidar.spec.name, frame, lidar.lidar.pattern().stamp(frame), is_done,
          is_done ? convergence_of(product_path(lidar, frame, scan_suffix)) : "");
    }
  }
  for (const PlacedCamera& camera : world_.cameras) {
    for (std::size_t i = 0; i < camera.begins.size(); ++i) {
      const auto frame = static_cast<std::int64_t>(i);
      add(camera.spec.name, frame, camera.begins[i], has(camera, frame), "");
    }
  }
  write_text(folder_ / "dataset.yaml", text);
}

}  // namespace groundray
