#include "apps/groundray/generate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/dataset/dataset_listing.h"
#include "apps/groundray/record/dataset.h"
#include "apps/groundray/record/images.h"
#include "apps/groundray/record/preview.h"
#include "apps/interruption.h"
#include "apps/scene/frame_scene.h"
#include "apps/scene/world.h"
#include "core/npy_io.h"
#include "core/ply_io.h"
#include "core/product_io.h"
#include "core/progress.h"

namespace groundray {
namespace {

using Clock = std::chrono::steady_clock;

struct Tally {
  std::uint64_t scans = 0;
  std::uint64_t images = 0;
  std::uint64_t pixels = 0;
  ImageTally of_images;
  std::chrono::duration<double> exposing{0};
  std::uint64_t points = 0;
  std::uint64_t pulses = 0;
  std::chrono::duration<double> scanning{0};
};

struct Frame {
  std::uint32_t sensor = 0;  // number: lidars come first, for images may show their echoes
  std::int64_t number = 0;
};

std::vector<Frame> missing_frames(const World& world, const Dataset& dataset) {
  std::vector<Frame> frames;
  for (std::uint32_t sensor = 0; sensor < world.lidars.size(); ++sensor) {
    for (std::int64_t number = 0; number < world.lidars[sensor].sweeps; ++number) {
      if (!dataset.has(world.lidars[sensor], number)) frames.push_back({sensor, number});
    }
  }
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    const auto sensor = static_cast<std::uint32_t>(world.lidars.size() + i);
    for (std::size_t k = 0; k < world.cameras[i].begins.size(); ++k) {
      const auto number = static_cast<std::int64_t>(k);
      if (!dataset.has(world.cameras[i], number)) frames.push_back({sensor, number});
    }
  }
  return frames;
}

// What a scan has beside its echoes, where asked for. The scan itself comes last: where it is, all
// is.
void write_extras(const Dataset& dataset, const PlacedLidar& lidar, std::int64_t frame,
                  const LidarScan& scan) {
  const LidarSpec& spec = lidar.spec.lidar;
  if (spec.no_returns == LidarSpec::NoReturns::Report)
    write_ply(dataset.product_path(lidar, frame, "_no_returns.ply"), scan.no_returns, {});
  if (spec.waveforms == LidarSpec::WaveformOutput::Omit) return;
  const Waveforms& waveforms = scan.waveforms;
  write_npy(dataset.product_path(lidar, frame, "_wave.npy"), {{"", "<f4"}},
            waveforms.power_w.size(), std::as_bytes(std::span(waveforms.power_w)));
  static_assert(sizeof(WaveformRun) == 24);  // as the fields below say
  write_npy(dataset.product_path(lidar, frame, "_wave_index.npy"),
            {{"pulse", "<u4"}, {"count", "<u4"}, {"first_sample", "<u8"}, {"start_s", "<f8"}},
            waveforms.runs.size(), std::as_bytes(std::span(waveforms.runs)));
}

std::vector<std::string> comments_of(const World& world, const LidarScan& scan) {
  const glm::dvec3 origin_m = world.terrain.header().origin_w_m;
  std::vector<std::string> comments{
      fmt::format("origin_w {} {} {}", origin_m.x, origin_m.y, origin_m.z)};
  const Convergence& seen = scan.convergence;
  if (seen.pulses > 0) {
    const double rms_m = std::sqrt(seen.sum_squares_m2 /
                                   static_cast<double>(std::max<std::uint64_t>(seen.compared, 1)));
    comments.push_back(
        fmt::format("{}{{pulses: {}, other_echoes: {}, range_rms_m: {:.3g}, range_max_m: {:.3g}}}",
                    convergence_comment, seen.pulses, seen.changed, rms_m, seen.largest_m));
  }
  if (scan.waveforms.interval_s > 0)
    comments.push_back(fmt::format("waveform_interval_s {}", scan.waveforms.interval_s));
  return comments;
}

void make_scan(const World& world, const Dataset& dataset, const Frame& which,
               FrameScene& scene_for, Tally& tally) {
  const auto [sensor, frame] = which;
  const PlacedLidar& lidar = world.lidars[sensor];
  const ScanPattern& pattern = lidar.lidar.pattern();
  const Scene& scene = scene_for(exposed(lidar, frame));
  const auto begin = Clock::now();
  const LidarScan scan = lidar.lidar.scan(scene, lidar.X_DS, frame, world.spec.seed, sensor);
  tally.scanning += Clock::now() - begin;
  tally.points += scan.echoes.rows();
  tally.pulses += static_cast<std::uint64_t>(pattern.pulses(frame));
  ++tally.scans;

  write_png(dataset.product_path(lidar, frame, "_preview.png"),
            draw_preview(scan.echoes, lidar, world.terrain.ground(), frame));
  write_extras(dataset, lidar, frame, scan);
  write_ply(dataset.product_path(lidar, frame, scan_suffix), scan.echoes, comments_of(world, scan));
}

void make_frame(const World& world, const Dataset& dataset, const Frame& which,
                FrameScene& scene_for, Tally& tally) {
  if (which.sensor < world.lidars.size()) return make_scan(world, dataset, which, scene_for, tally);
  const std::size_t camera = which.sensor - world.lidars.size();
  const auto begin = Clock::now();
  show_echoes(world, dataset, camera, which.number,
              [&](const Exposed& frame) -> const Scene& { return scene_for(frame); });
  const Scene& scene = scene_for(exposed(world.cameras[camera], which.number));
  const ImageTally made = make_image(world, dataset, camera, which.number, scene);
  tally.of_images.paths += made.paths;
  tally.of_images.flows_left_out += made.flows_left_out;
  tally.exposing += Clock::now() - begin;
  const glm::ivec2 size_px = world.cameras[camera].spec.camera.size_px;
  tally.pixels += static_cast<std::uint64_t>(size_px.x) * static_cast<std::uint64_t>(size_px.y);
  ++tally.images;
}

void say(const World& world, const std::filesystem::path& out, const Tally& tally) {
  std::uint64_t scans = 0, images = 0;
  for (const PlacedLidar& lidar : world.lidars) scans += static_cast<std::uint64_t>(lidar.sweeps);
  for (const PlacedCamera& camera : world.cameras) images += camera.begins.size();
  if (tally.scans < scans) fmt::print("{} scans were there already\n", scans - tally.scans);
  if (tally.images < images) fmt::print("{} images were there already\n", images - tally.images);
  if (tally.scans > 0) {
    fmt::print("{} scans, {} points of {} pulses, {:.2f} M pulses/s\n", tally.scans, tally.points,
               tally.pulses, 1e-6 * static_cast<double>(tally.pulses) / tally.scanning.count());
  }
  if (tally.images > 0) {
    fmt::print("{} images, {:.1f} M pixels, {:.1f} M paths in {:.1f} s\n", tally.images,
               1e-6 * static_cast<double>(tally.pixels),
               1e-6 * static_cast<double>(tally.of_images.paths), tally.exposing.count());
  }
  if (tally.of_images.flows_left_out > 0) {
    fmt::print("{} flows beyond 512 px are marked as unknown in KITTI's files\n",
               tally.of_images.flows_left_out);
  }
  fmt::print("dataset: {}\n", out.string());
  for (const PlacedLidar& lidar : world.lidars) {
    fmt::print("  {}: scans and pictures (*_preview.png) in {}\n", lidar.spec.name,
               (out / "lidar" / lidar.spec.name).string());
  }
  for (const PlacedCamera& camera : world.cameras) {
    fmt::print("  {}: images and pictures (*_preview.png) in {}\n", camera.spec.name,
               (out / "camera" / camera.spec.name).string());
  }
}

}  // namespace

void generate(const std::filesystem::path& scene, const std::filesystem::path& out,
              std::optional<Seed> seed) {
  const World world = load_world(scene, seed);
  if (world.terrain.whole() == nullptr) {
    // Says what memory is too small before anything is written.
    world.terrain.clipmap(sensor_box(first_frame(world)), world.reach_m);
  }
  const Dataset dataset(out, world);
  const std::vector<Frame> frames = missing_frames(world, dataset);
  FrameScene scene_for(world);
  Tally tally;
  try {
    Progress progress(stderr, "frames", frames.size());
    for (const Frame& frame : frames) {
      if (is_interrupted()) break;
      make_frame(world, dataset, frame, scene_for, tally);
      progress.update(tally.scans + tally.images);
    }
  } catch (...) {
    dataset.record();
    throw;
  }
  dataset.record();
  if (tally.scans + tally.images < frames.size()) {
    throw Interrupted{};
  }
  say(world, out, tally);
}

}  // namespace groundray
