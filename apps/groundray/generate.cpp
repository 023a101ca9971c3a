#include "apps/groundray/generate.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "apps/groundray/record/images.h"
#include "apps/groundray/record/scans.h"
#include "apps/groundray/run/background_writer.h"
#include "apps/groundray/run/frame_maker.h"
#include "apps/groundray/run/frame_plan.h"
#include "apps/groundray/run/run_log.h"
#include "apps/scene/interruption.h"
#include "apps/scene/simulation.h"
#include "core/error.h"
#include "core/progress.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct Tally {
  std::uint64_t scans = 0;
  std::uint64_t images = 0;
  std::uint64_t pixels = 0;
  std::uint64_t paths = 0;
  std::uint64_t flows_left_out = 0;
  std::chrono::duration<double> exposing{0};
  std::uint64_t points = 0;
  std::uint64_t pulses = 0;
  std::chrono::duration<double> scanning{0};
};

void count_scan(const Simulation& simulation, const MadeFrame& made, Tally& tally,
                FrameDone& done) {
  const auto& scan = std::get<LidarScan>(made.product);
  const PlacedLidar& lidar = simulation.lidars[made.name.sensor];
  tally.scanning += made.tracing;
  tally.points += scan.echoes.rows();
  tally.pulses += static_cast<std::uint64_t>(lidar.lidar.pattern().pulses(made.name.number));
  ++tally.scans;
  done.sensor = lidar.spec.name;
  done.samples = "points";
  done.count = scan.echoes.rows();
}

void count_image(const Simulation& simulation, const MadeFrame& made, Tally& tally,
                 FrameDone& done) {
  const MountedCamera& camera =
      simulation.cameras[made.name.sensor - simulation.lidars.size()].spec;
  const glm::ivec2 size_px = camera.camera.size_px;
  done.sensor = camera.name;
  done.samples = "pixels";
  done.count = static_cast<std::uint64_t>(size_px.x) * static_cast<std::uint64_t>(size_px.y);
  tally.pixels += done.count;
  tally.paths += std::get<MadeImage>(made.product).paths;
  tally.exposing += made.making;
  ++tally.images;
}

// Returns the processor time of this thread.
std::chrono::duration<double> thread_cpu() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

// Writes a frame and records it in the dataset.
FrameDone write_frame(const Simulation& simulation, DatasetWriter& dataset, const MadeFrame& made,
                      Tally& tally) {
  const auto begin = Clock::now();
  const auto cpu_begin = thread_cpu();
  const auto [sensor, number] = made.name;
  FrameDone done{.sensor = {}, .frame = number, .samples = {}, .tracing = made.making};
  if (sensor < simulation.lidars.size()) {
    write_scan(simulation, dataset, sensor, number, std::get<LidarScan>(made.product));
    count_scan(simulation, made, tally, done);
  } else {
    tally.flows_left_out += write_image(simulation, dataset, sensor - simulation.lidars.size(),
                                        number, std::get<MadeImage>(made.product), made.echoes);
    count_image(simulation, made, tally, done);
  }
  done.bytes = dataset.note(sensor, number);
  done.writing = Clock::now() - begin;
  done.writing_cpu = thread_cpu() - cpu_begin;
  return done;
}

// Makes frames; each is written while the next one is made.
void make_frames(const Simulation& simulation, DatasetWriter& dataset,
                 const std::vector<FrameName>& frames, RunLog& log, Tally& tally) {
  FrameMaker maker(simulation, dataset);
  std::atomic<std::uint64_t> written = 0;
  Progress progress(stderr, "frames", frames.size());
  BackgroundWriter writer;
  bool was_scan = false;
  try {
    for (const FrameName& name : frames) {
      if (is_interrupted()) break;
      const bool is_image = name.sensor >= simulation.lidars.size();
      if (is_image && was_scan) writer.wait();  // images may show scans
      was_scan = !is_image;
      auto made = std::make_unique<MadeFrame>(maker.make(name));
      writer.begin(
          [&simulation, &dataset, &log, &tally, &written, made = std::move(made)]() mutable {
            log.frame_done(write_frame(simulation, dataset, *made, tally));
            made.reset();
            ++written;
          });
      progress.update(written);
    }
    writer.wait();
    progress.update(written);
  } catch (...) {
    writer.fail(std::current_exception());
  }
}

void say_faults(const fs::path& out, const std::vector<std::string>& faults) {
  constexpr std::size_t most = 20;
  for (std::size_t i = 0; i < faults.size() && i < most; ++i)
    fmt::print(stderr, "{}: {}\n", out.string(), faults[i]);
  if (faults.size() > most) fmt::print(stderr, "and {} more\n", faults.size() - most);
}

void say(const Simulation& simulation, const fs::path& out, const FramePlan& plan,
         const Tally& tally, std::FILE* to) {
  if (tally.scans < plan.scans)
    fmt::print(to, "{} scans already existed\n", plan.scans - tally.scans);
  if (tally.images < plan.images)
    fmt::print(to, "{} images already existed\n", plan.images - tally.images);
  if (tally.scans > 0) {
    fmt::print(to, "{} scans, {} points of {} pulses, {:.2f} M pulses/s\n", tally.scans,
               tally.points, tally.pulses,
               1e-6 * static_cast<double>(tally.pulses) / tally.scanning.count());
  }
  if (tally.images > 0) {
    fmt::print(to, "{} images, {:.1f} M pixels, {:.1f} M paths in {:.1f} s\n", tally.images,
               1e-6 * static_cast<double>(tally.pixels), 1e-6 * static_cast<double>(tally.paths),
               tally.exposing.count());
  }
  if (tally.flows_left_out > 0) {
    fmt::print(to, "{} flows beyond 512 px are marked as unknown in KITTI's files\n",
               tally.flows_left_out);
  }
  fmt::print(to, "dataset: {}\n", out.string());
  for (const PlacedLidar& lidar : simulation.lidars) {
    fmt::print(to, "  {}: scans and pictures (*_preview.png) in {}\n", lidar.spec.name,
               (out / "lidar" / lidar.spec.name).string());
  }
  for (const PlacedCamera& camera : simulation.cameras) {
    fmt::print(to, "  {}: images and pictures (*_preview.png) in {}\n", camera.spec.name,
               (out / "camera" / camera.spec.name).string());
  }
}

void run(const fs::path& scene, const fs::path& out, const GenerateOptions& options, RunLog& log) {
  const Simulation simulation = load_simulation(scene, options.seed);
  if (simulation.terrain.whole() == nullptr) {
    // Reports insufficient memory before anything is written.
    simulation.terrain.clipmap(sensor_box(first_frame(simulation)), simulation.reach_m);
  }
  DatasetWriter dataset(out, simulation, options.use, options.shard);
  say_faults(out, dataset.faults());
  const FramePlan plan = plan_frames(simulation, dataset, options.shard);
  log.begun({.scene = scene,
             .output = out,
             .seed = simulation.spec.seed.value,
             .shard = options.shard ? text_of(*options.shard) : "",
             .frames = plan.frames.size(),
             .there = plan.scans + plan.images - plan.frames.size()});
  Tally tally;
  try {
    make_frames(simulation, dataset, plan.frames, log, tally);
  } catch (...) {
    try {
      dataset.close();
    } catch (const Error&) {
      // Not reported: the error that stopped the run is rethrown.
    }
    throw;
  }
  dataset.close();
  if (tally.scans + tally.images < plan.frames.size()) throw Interrupted{};
  say(simulation, out, plan, tally, log.takes_output() ? stderr : stdout);
}

}  // namespace

void generate(const fs::path& scene, const fs::path& out, const GenerateOptions& options) {
  RunLog log(options.log);
  try {
    run(scene, out, options, log);
  } catch (const Interrupted&) {
    log.ended("interrupted", "");
    throw;
  } catch (const std::exception& error) {
    log.ended("failed", error.what());
    throw;
  }
  log.ended("end", "");
}

}  // namespace groundray
