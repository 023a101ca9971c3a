#include "apps/groundray/generate.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "apps/groundray/dataset.h"
#include "apps/groundray/interruption.h"
#include "apps/groundray/preview.h"
#include "apps/groundray/world.h"
#include "core/ply_io.h"
#include "core/product_io.h"
#include "core/progress.h"
#include "terrain/terrain_scene.h"

namespace groundray {
namespace {

using Clock = std::chrono::steady_clock;

struct Tally {
  std::uint64_t scans = 0;
  std::uint64_t points = 0;
  std::uint64_t pulses = 0;
  std::chrono::duration<double> scanning{0};
};

// Makes scenes as frames ask for them: the float frame L follows the sensor over its lattice, the
// levels of the terrain follow its positions during the frame, so that a frame's bytes depend on
// the frame alone.
class SceneFor {
 public:
  explicit SceneFor(const World& world) : world_(world) {}

  const Scene& operator()(const PlacedLidar& lidar, std::int64_t frame) {
    const glm::dvec3 p_DL =
        float_frame_origin(lidar.X_DS.pose_at(lidar.lidar.pattern().stamp(frame)).translation_m);
    const HeightGrid* whole = world_.terrain.whole();
    if (whole == nullptr) {
      const SensorBox sensors = sensor_box(lidar, frame);
      clipmap_ =
          clipmap_ ? clipmap_->moved_to(sensors) : world_.terrain.clipmap(sensors, world_.reach_m);
      take(build_tracer(*clipmap_, p_DL, world_.spec.tracing, scene_ ? &scene_->rays : nullptr));
    } else if (!scene_ || p_DL != p_DL_) {
      scene_.reset();  // before the next one is built: two would need twice the memory
      take({{full_resolution_level(*whole)}, p_DL, world_.spec.tracing});
    }
    p_DL_ = p_DL;
    return *scene_;
  }

 private:
  void take(RayTracer rays) { scene_ = Scene{std::move(rays), {world_.spec.terrain.label, 0}}; }

  const World& world_;
  glm::dvec3 p_DL_{0};
  std::optional<Clipmap> clipmap_;
  std::optional<Scene> scene_;
};

struct Frame {
  std::uint32_t sensor = 0;  // index of the lidar
  std::int64_t number = 0;
};

std::vector<Frame> missing_frames(const World& world, const Dataset& dataset) {
  std::vector<Frame> frames;
  for (std::uint32_t sensor = 0; sensor < world.lidars.size(); ++sensor) {
    for (std::int64_t number = 0; number < world.lidars[sensor].sweeps; ++number) {
      if (!dataset.has(world.lidars[sensor], number)) frames.push_back({sensor, number});
    }
  }
  return frames;
}

void make_frame(const World& world, const Dataset& dataset, const Frame& which, SceneFor& scene_for,
                Tally& tally) {
  const auto [sensor, frame] = which;
  const PlacedLidar& lidar = world.lidars[sensor];
  const ScanPattern& pattern = lidar.lidar.pattern();
  const Scene& scene = scene_for(lidar, frame);
  const auto begin = Clock::now();
  const PointCloud scan = lidar.lidar.scan(scene, lidar.X_DS, frame, world.spec.seed, sensor);
  tally.scanning += Clock::now() - begin;
  tally.points += scan.rows();
  tally.pulses += static_cast<std::uint64_t>(pattern.first_sequence(frame + 1) -
                                             pattern.first_sequence(frame)) *
                  pattern.shots().size();
  ++tally.scans;

  const glm::dvec3 origin_m = world.terrain.header().origin_w_m;
  write_png(dataset.preview_path(lidar, frame),
            draw_preview(scan, lidar, world.terrain.ground(), frame));
  write_ply(dataset.scan_path(lidar, frame), scan,
            {fmt::format("origin_w {} {} {}", origin_m.x, origin_m.y, origin_m.z)});
}

void say(const World& world, const std::filesystem::path& out, const Tally& tally) {
  std::uint64_t scans = 0;
  for (const PlacedLidar& lidar : world.lidars) scans += static_cast<std::uint64_t>(lidar.sweeps);
  if (tally.scans < scans) fmt::print("{} scans were there already\n", scans - tally.scans);
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

void generate(const std::filesystem::path& scene, const std::filesystem::path& out) {
  const World world = load_world(scene);
  if (world.terrain.whole() == nullptr) {
    // Says what memory is too small before anything is written.
    world.terrain.clipmap(sensor_box(world.lidars.front(), 0), world.reach_m);
  }
  const Dataset dataset(out, world);
  const std::vector<Frame> frames = missing_frames(world, dataset);
  SceneFor scene_for(world);
  Tally tally;
  try {
    Progress progress(stderr, "scans", frames.size());
    for (const Frame& frame : frames) {
      if (is_interrupted()) break;
      make_frame(world, dataset, frame, scene_for, tally);
      progress.update(tally.scans);
    }
  } catch (...) {
    dataset.record();
    throw;
  }
  dataset.record();
  if (tally.scans < frames.size()) {
    throw Interrupted{};
  }
  say(world, out, tally);
}

}  // namespace groundray
