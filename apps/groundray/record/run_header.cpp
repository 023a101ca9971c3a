#include "apps/groundray/record/run_header.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <variant>

#include "apps/groundray/record/calibration_text.h"
#include "apps/scene/fingerprint.h"
#include "core/io/file_io.h"

namespace groundray {
namespace {

// Formats seconds with nine decimals, exactly for any epoch of the clock.
std::string decimal_seconds(std::chrono::nanoseconds time) {
  const std::int64_t count = time.count();
  return fmt::format("{}{}.{:09}", count < 0 ? "-" : "", std::abs(count / 1'000'000'000),
                     std::abs(count % 1'000'000'000));
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

std::uint64_t fingerprint(const Simulation& simulation) {
  static_assert(sizeof(Trajectory::Sample) == 8 * sizeof(double),
                "no padding, whose bytes are anything");
  Fingerprint print;
  print.add(std::span<const char>(simulation.terrain.fingerprint()));
  for (const PlacedLidar& lidar : simulation.lidars) {
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
  for (const PlacedCamera& camera : simulation.cameras) {
    print.add(std::span(camera.X_DC.samples()));
    print.add(std::span<const char>(calibration_text(camera)));
    add_lens(camera.camera.lens(), print);
  }
  if (const auto& sky = simulation.spec.sky) {
    if (const auto* environment = std::get_if<EnvironmentImage>(&sky->dome))
      print.add(std::span<const char>(read_text(environment->image)));
  }
  for (const Material& material : simulation.scene_objects.materials.all())
    print.add_all(fingerprint_of(material));
  print.add(std::span<const char>(simulation.scene_objects.fingerprint));
  return print.value();
}

}  // namespace

std::string run_header(const Simulation& simulation) {
  const glm::dvec3 origin_m = simulation.terrain.header().origin_w_m;
  std::string text = fmt::format(
      "groundray_dataset: 1\nversion: {}\nseed: {}\ntracing: {}\ninputs: "
      "\"{:016x}\"\ntime_origin_s: {}\n"
      "origin_w_m: [{}, {}, {}]\ncrs: "
      "{}\ncrs_wkt: {}\nscene: "
      "{}\nsensors:\n",
      yaml_text(GROUNDRAY_VERSION), simulation.spec.seed.value,
      simulation.spec.tracing == Tracing::Fast ? "fast" : "exact", fingerprint(simulation),
      decimal_seconds(simulation.begin), origin_m.x, origin_m.y, origin_m.z,
      yaml_text(simulation.terrain.header().crs_name),
      yaml_text(simulation.terrain.header().crs_wkt), yaml_text(simulation.spec.text));
  for (std::size_t i = 0; i < simulation.lidars.size(); ++i) {
    const MountedLidar& spec = simulation.lidars[i].spec;
    text += fmt::format(
        "  - {{name: {}, kind: lidar, number: {}, model: {}, source: {}, frames: {}}}\n",
        yaml_text(spec.name), i, yaml_text(spec.lidar.model), yaml_text(spec.source),
        simulation.lidars[i].sweeps);
  }
  for (std::size_t i = 0; i < simulation.cameras.size(); ++i) {
    const MountedCamera& spec = simulation.cameras[i].spec;
    text += fmt::format(
        "  - {{name: {}, kind: camera, number: {}, model: {}, source: {}, frames: {}}}\n",
        yaml_text(spec.name), simulation.lidars.size() + i, yaml_text(spec.camera.model),
        yaml_text(spec.source), simulation.cameras[i].begins.size());
  }
  for (const StereoSpec& pair : simulation.spec.stereo) {
    text += fmt::format("  - {{name: {}, kind: stereo, left: {}, right: {}, images: {}}}\n",
                        yaml_text(pair.name), yaml_text(pair.left), yaml_text(pair.right),
                        pair.images == StereoSpec::Images::Rectified ? "rectified" : "as_mounted");
  }
  if (!simulation.cameras.empty()) {
    text += "materials:  # by number in images, from 1\n";
    for (const Material& material : simulation.scene_objects.materials.all())
      text += fmt::format("  - {}\n", yaml_text(material.name));
  }
  if (!simulation.scene_objects.groups.empty()) text += "objects:\n";
  for (const SceneObjects::Group& group : simulation.scene_objects.groups) {
    text += fmt::format("  - {{name: {}, label: {}, first_instance: {}, count: {}}}\n",
                        yaml_text(group.name), group.label, group.first, group.count);
  }
  return text;
}

}  // namespace groundray
