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
#include "core/product_io.h"

namespace groundray {
namespace {

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

}  // namespace

std::string run_header(const World& world) {
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

}  // namespace groundray
