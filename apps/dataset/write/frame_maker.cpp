#include "apps/dataset/write/frame_maker.h"

#include <algorithm>
#include <atomic>
#include <ctime>
#include <exception>
#include <memory>

#include "apps/dataset/dataset_reader.h"
#include "apps/dataset/write/background_writer.h"
#include "apps/scene/interruption.h"
#include "core/io/ply_io.h"

namespace groundray {
namespace {

using Clock = std::chrono::steady_clock;

// Returns the interval of the run in which a frame is made. An image is never in an earlier
// interval than the scans it shows.
std::int64_t part_of(const Simulation& simulation, const FrameName& name) {
  constexpr std::chrono::seconds part(10);
  const Exposed frame = exposed(simulation, name.sensor, name.number);
  const bool is_scan = name.sensor < simulation.lidars.size();
  return (is_scan ? frame.begin : frame.begin + (frame.end - frame.begin) / 2) / part;
}

// Returns the processor time of this thread.
std::chrono::duration<double> thread_cpu() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

FramePlan plan_frames(const Simulation& simulation, const DatasetWriter& dataset) {
  FramePlan plan;
  for (std::uint32_t sensor = 0; sensor < dataset.sensor_count(); ++sensor) {
    for (std::int64_t number = 0; number < dataset.frames(sensor); ++number) {
      if (!dataset.includes(sensor, number)) continue;
      ++(sensor < simulation.lidars.size() ? plan.scans : plan.images);
      if (!dataset.has(sensor, number)) plan.frames.push_back({sensor, number});
    }
  }
  // Frames are listed by sensor, so the first of each differs in its sensor from the one before.
  std::vector<FrameName> first, others;
  for (const FrameName& name : plan.frames)
    (first.empty() || first.back().sensor != name.sensor ? first : others).push_back(name);
  std::ranges::stable_sort(others, {},
                           [&](const FrameName& name) { return part_of(simulation, name); });
  plan.frames = std::move(first);
  plan.frames.insert(plan.frames.end(), others.begin(), others.end());
  return plan;
}

MadeFrame FrameMaker::make(const FrameName& name) {
  const auto begin = Clock::now();
  MadeFrame made{.name = name, .product = {}};
  if (name.sensor < simulation_.lidars.size()) {
    made.product = trace_scan(name.sensor, name.number, made.tracing);
  } else {
    const std::size_t camera = name.sensor - simulation_.lidars.size();
    for (const OverlaidScan& shown : shown_scans(simulation_, camera, name.number)) {
      const PointCloud& cloud = echoes_of(shown);
      const Scene& scene = scene_for_(exposed(simulation_, shown.lidar, shown.scan));
      made.echoes.push_back(show_echoes(simulation_, camera, name.number, shown, cloud, scene));
    }
    const Scene& scene = scene_for_(exposed(simulation_, name.sensor, name.number));
    const auto traced_from = Clock::now();
    const auto blocks = static_cast<double>(simulation_.cameras[camera].camera.checks());
    std::atomic<std::size_t> begun = 0;
    made.product = make_image(simulation_, camera, name.number, scene, [&] {
      stop_if_interrupted();
      if (watch_) watch_(name, std::min(1.0, static_cast<double>(begun++) / blocks));
    });
    made.tracing = Clock::now() - traced_from;
  }
  made.making = Clock::now() - begin;
  return made;
}

ExposureSetting FrameMaker::exposure_of(const FrameName& image) {
  const Scene& scene = scene_for_(exposed(simulation_, image.sensor, image.number));
  return groundray::exposure_of(simulation_, image.sensor - simulation_.lidars.size(), image.number,
                                scene);
}

LidarScan FrameMaker::trace_scan(std::uint32_t sensor, std::int64_t frame,
                                 std::chrono::duration<double>& tracing) {
  const Scene& scene = scene_for_(exposed(simulation_, sensor, frame));
  const auto begin = Clock::now();
  LidarScan scan = make_scan(simulation_, sensor, frame, scene, [&](double share) {
    if (watch_) watch_({sensor, frame}, share);
    return true;
  });
  tracing += Clock::now() - begin;
  return scan;
}

// Returns the echoes from their file, or makes the scan again if it belongs to another shard.
const PointCloud& FrameMaker::echoes_of(const OverlaidScan& shown) {
  const auto last = shown_last_.find(shown.lidar);
  if (last != shown_last_.end() && last->second.first == shown.scan) return last->second.second;
  std::chrono::duration<double> tracing{0};
  PointCloud echoes =
      dataset_.has(shown.lidar, shown.scan)
          ? read_ply(dataset_.product_path(shown.lidar, shown.scan, scan_suffix)).cloud
          : trace_scan(shown.lidar, shown.scan, tracing).echoes;
  return shown_last_.insert_or_assign(shown.lidar, std::pair(shown.scan, std::move(echoes)))
      .first->second.second;
}

WrittenFrame write_frame(const Simulation& simulation, DatasetWriter& dataset,
                         const MadeFrame& made) {
  const auto begin = Clock::now();
  const auto cpu_begin = thread_cpu();
  const auto [sensor, number] = made.name;
  WrittenFrame written;
  if (const auto* scan = std::get_if<LidarScan>(&made.product)) {
    write_scan(simulation, dataset, sensor, number, *scan);
  } else {
    written.image = write_image(simulation, dataset, sensor - simulation.lidars.size(), number,
                                std::get<MadeImage>(made.product), made.echoes);
  }
  written.bytes = dataset.note(sensor, number);
  written.writing = Clock::now() - begin;
  written.writing_cpu = thread_cpu() - cpu_begin;
  return written;
}

void make_frames(const Simulation& simulation, DatasetWriter& dataset,
                 const std::vector<FrameName>& frames,
                 const std::function<void(const MadeFrame&, const WrittenFrame&)>& written,
                 const FrameWatch& watch) {
  FrameMaker maker(simulation, dataset, watch);
  BackgroundWriter writer;
  bool was_scan = false;
  try {
    for (const FrameName& name : frames) {
      if (is_interrupted()) break;
      const bool is_image = name.sensor >= simulation.lidars.size();
      if (is_image && was_scan) writer.wait();  // images may show scans
      was_scan = !is_image;
      writer.begin([&, made = std::make_unique<MadeFrame>(maker.make(name))]() mutable {
        written(*made, write_frame(simulation, dataset, *made));
        made.reset();
      });
    }
    writer.wait();
  } catch (...) {
    writer.fail(std::current_exception());
  }
}

}  // namespace groundray
