#include "apps/groundray/generate.h"

#include <fmt/format.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <optional>

#include "apps/groundray/dataset.h"
#include "apps/groundray/preview.h"
#include "apps/groundray/world.h"
#include "core/ply_io.h"
#include "core/product_io.h"
#include "core/progress.h"
#include "terrain/terrain_scene.h"

namespace groundray {
namespace {

using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t stop_requested = 0;

// The first signal asks for an orderly end, the second ends the process as usual.
void stop_in_order(int signal) {
  stop_requested = 1;
  std::signal(signal, SIG_DFL);
}

struct Tally {
  std::uint64_t scans = 0;
  std::uint64_t points = 0;
  std::uint64_t pulses = 0;
  std::chrono::duration<double> scanning{0};
};

// Makes scenes as frames ask for them: the float frame L follows the viewpoint over its lattice, so
// that a frame's bytes depend on the frame alone.
class SceneFor {
 public:
  explicit SceneFor(const World& world) : world_(world) {}

  const Scene& operator()(const glm::dvec3& viewpoint) {
    const glm::dvec3 p_DL = float_frame_origin(viewpoint);
    if (!scene_ || p_DL != p_DL_) {
      scene_.reset();  // before the next one is built: two would need twice the memory
      scene_.emplace(
          Scene{RayTracer({full_resolution_level(world_.dem.grid)}, p_DL, world_.spec.tracing),
                {world_.spec.terrain.label, 0}});
      p_DL_ = p_DL;
    }
    return *scene_;
  }

 private:
  const World& world_;
  glm::dvec3 p_DL_{0};
  std::optional<Scene> scene_;
};

void make_frame(const World& world, const Dataset& dataset, std::uint32_t sensor_number,
                std::int64_t frame, SceneFor& scene_for, Tally& tally) {
  const PlacedLidar& lidar = world.lidars[sensor_number];
  const ScanPattern& pattern = lidar.lidar.pattern();
  const Scene& scene = scene_for(lidar.X_DS.pose_at(pattern.stamp(frame)).translation_m);
  const auto begin = Clock::now();
  const PointCloud scan =
      lidar.lidar.scan(scene, lidar.X_DS, frame, world.spec.seed, sensor_number);
  tally.scanning += Clock::now() - begin;
  tally.points += scan.rows();
  tally.pulses += static_cast<std::uint64_t>(pattern.first_sequence(frame + 1) -
                                             pattern.first_sequence(frame)) *
                  pattern.shots().size();
  ++tally.scans;

  const glm::dvec3 origin_m = world.dem.origin_w_m;
  write_png(dataset.preview_path(lidar, frame), draw_preview(scan, lidar, world.dem, frame));
  write_ply(dataset.scan_path(lidar, frame), scan,
            {fmt::format("origin_w {} {} {}", origin_m.x, origin_m.y, origin_m.z)});
}

void say(const World& world, const std::filesystem::path& out, const Tally& tally,
         std::uint64_t there_before) {
  if (there_before > 0) fmt::print("{} scans were there already\n", there_before);
  if (tally.scans > 0) {
    fmt::print("{} scans, {} points of {} pulses, {:.2f} M rays/s\n", tally.scans, tally.points,
               tally.pulses, 1e-6 * static_cast<double>(tally.pulses) / tally.scanning.count());
  }
  fmt::print("dataset: {}\n", out.string());
  for (const PlacedLidar& lidar : world.lidars) {
    fmt::print("  {}: scans and pictures (*_preview.png) in {}\n", lidar.spec.name,
               (out / "lidar" / lidar.spec.name).string());
  }
}

}  // namespace

RunEnd generate(const std::filesystem::path& scene, const std::filesystem::path& out) {
  std::signal(SIGINT, stop_in_order);
  std::signal(SIGTERM, stop_in_order);
  const World world = load_world(scene);
  const Dataset dataset(out, world);
  std::uint64_t total = 0;
  for (const PlacedLidar& lidar : world.lidars) total += static_cast<std::uint64_t>(lidar.sweeps);

  SceneFor scene_for(world);
  Tally tally;
  std::uint64_t there_before = 0;
  Progress progress(stderr, "scans", total);
  for (std::uint32_t sensor = 0; sensor < world.lidars.size(); ++sensor) {
    for (std::int64_t frame = 0; frame < world.lidars[sensor].sweeps; ++frame) {
      if (stop_requested != 0) {
        dataset.record();
        fmt::print(stderr, "\ninterrupted; the same command goes on from here\n");
        return RunEnd::Interrupted;
      }
      if (dataset.has(world.lidars[sensor], frame)) {
        ++there_before;
      } else {
        make_frame(world, dataset, sensor, frame, scene_for, tally);
      }
      progress.update(there_before + tally.scans);
    }
  }
  dataset.record();
  say(world, out, tally, there_before);
  return RunEnd::Done;
}

}  // namespace groundray
