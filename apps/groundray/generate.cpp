#include "apps/groundray/generate.h"

#include <fmt/format.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>
#include <tuple>
#include <variant>
#include <vector>

#include "apps/dataset/write/frame_maker.h"
#include "apps/groundray/frame_progress.h"
#include "apps/groundray/run_log.h"
#include "apps/scene/interruption.h"
#include "apps/scene/notes.h"
#include "apps/scene/simulation.h"
#include "core/error.h"
#include "core/io/print_error.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Images of a camera of which more than 1 % is saturated.
struct SaturatedImages {
  std::uint64_t count = 0;
  double most_share = 0;
  std::int64_t most_image = 0;  // with the largest share

  void add(std::int64_t image, double share) {
    if (share <= 0.01) return;
    ++count;
    if (share > most_share) std::tie(most_share, most_image) = std::tie(share, image);
  }
};

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
  std::vector<SaturatedImages> saturated;  // by camera
};

// Adds a frame to the tally, and returns its entry in the log.
LogFields count(const Simulation& simulation, const MadeFrame& made, const WrittenFrame& written,
                Tally& tally) {
  const auto [sensor, number] = made.name;
  LogFields entry;
  const auto add_common = [&](const std::string& name) {
    entry.add("sensor", name);
    entry.add("frame", made.name.number);
    entry.add("tracing_s", log_seconds(made.making));
    entry.add("writing_s", log_seconds(written.writing));
    entry.add("writing_cpu_s", log_seconds(written.writing_cpu));
  };
  if (const auto* scan = std::get_if<LidarScan>(&made.product)) {
    const PlacedLidar& lidar = simulation.lidars[sensor];
    tally.scanning += made.tracing;
    tally.points += scan->echoes.rows();
    tally.pulses += static_cast<std::uint64_t>(lidar.lidar.pattern().pulses(number));
    ++tally.scans;
    add_common(lidar.spec.name);
    entry.add("points", scan->echoes.rows());
  } else {
    const std::size_t number_of_camera = sensor - simulation.lidars.size();
    const MountedCamera& camera = simulation.cameras[number_of_camera].spec;
    tally.saturated[number_of_camera].add(number, written.image.saturated_share);
    const glm::ivec2 size_px = camera.camera.size_px;
    const auto pixels =
        static_cast<std::uint64_t>(size_px.x) * static_cast<std::uint64_t>(size_px.y);
    tally.pixels += pixels;
    tally.paths += std::get<MadeImage>(made.product).paths;
    tally.exposing += made.making;
    tally.flows_left_out += written.image.flows_left_out;
    ++tally.images;
    add_common(camera.name);
    entry.add("pixels", pixels);
    if (gives_signal(camera.camera)) entry.add("saturated", written.image.saturated_share);
  }
  entry.add("bytes", written.bytes);
  return entry;
}

void say_faults(const fs::path& out, const std::vector<std::string>& faults) {
  constexpr std::size_t most = 20;
  for (std::size_t i = 0; i < faults.size() && i < most; ++i)
    print_error("{}: {}\n", out.string(), faults[i]);
  if (faults.size() > most) print_error("and {} more\n", faults.size() - most);
}

std::string millions(double count) {
  const double in_millions = 1e-6 * count;
  return in_millions < 100 ? fmt::format("{:.3g} M", in_millions)
                           : fmt::format("{:.0f} M", in_millions);
}

std::string counted(std::size_t count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

void say(const Simulation& simulation, const fs::path& out, const FramePlan& plan,
         const FrameChoice& choice, const Tally& tally, std::FILE* to) {
  if (tally.scans < plan.scans)
    print_text(to, "{} scans already existed\n", plan.scans - tally.scans);
  if (tally.images < plan.images)
    print_text(to, "{} images already existed\n", plan.images - tally.images);
  if (tally.scans > 0) {
    print_text(to, "{}, {} points of {} pulses, {} pulses/s\n", counted(tally.scans, "scan"),
               tally.points, tally.pulses,
               millions(static_cast<double>(tally.pulses) / tally.scanning.count()));
  }
  if (tally.images > 0) {
    print_text(to, "{}, {} pixels, {} paths in {:.1f} s\n", counted(tally.images, "image"),
               millions(static_cast<double>(tally.pixels)),
               millions(static_cast<double>(tally.paths)), tally.exposing.count());
  }
  if (tally.flows_left_out > 0) {
    print_text(to, "{} flows beyond 512 px are marked as unknown in KITTI's files\n",
               tally.flows_left_out);
  }
  print_text(to, "dataset: {}\n", out.string());
  for (const PlacedLidar& lidar : simulation.lidars) {
    if (!choice.has_sensor(lidar.spec.name)) continue;
    print_text(to, "  {}: scans and previews (*_preview.png) in {}\n", lidar.spec.name,
               (out / "lidar" / lidar.spec.name).string());
  }
  for (const PlacedCamera& camera : simulation.cameras) {
    if (!choice.has_sensor(camera.spec.name)) continue;
    const bool has_pictures = gives(camera.spec.camera, CameraProduct::Picture);
    print_text(to, "  {}: images{} and previews (*_preview.png) in {}\n", camera.spec.name,
               has_pictures ? ", pictures (*.png)" : "",
               (out / "camera" / camera.spec.name).string());
  }
}

void log_begin(const fs::path& scene, const fs::path& out, Seed seed, const RunPart& part,
               const FramePlan& plan, RunLog& log) {
  LogFields fields;
  fields.add("version", GROUNDRAY_VERSION);
  fields.add("scene", scene.string());
  fields.add("output", out.string());
  fields.add("seed", seed.value);
  if (part.shard) fields.add("shard", text_of(*part.shard));
  if (const std::string text = text_of(part.choice); !text.empty()) fields.add("chosen", text);
  fields.add("frames", plan.frames.size());
  fields.add("there", plan.scans + plan.images - plan.frames.size());
  log.begun(plan.frames.size(), fields);
}

// Returns a sentence for each camera with images of which more than 1 % is saturated.
std::vector<std::string> saturation_notes(const Simulation& simulation, const Tally& tally) {
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < tally.saturated.size(); ++i) {
    const auto [images, most_share, most_image] = tally.saturated[i];
    if (images == 0) continue;
    const MountedCamera& camera = simulation.cameras[i].spec;
    notes.push_back(fmt::format(
        "camera '{}': {} with more than 1 % of the pixels saturated, {:.3g} % in image {}; {}",
        camera.name, counted(images, "image"), 100 * most_share, most_image,
        camera.camera.shutter.automatic
            ? "choose a lower `target` or a shorter `shortest_us` in `shutter.automatic`"
            : "choose a shorter `shutter.exposure_ms`, or `shutter: {automatic: {}}`"));
  }
  return notes;
}

void run(const fs::path& scene, const fs::path& out, const GenerateOptions& options, RunLog& log) {
  const Simulation simulation = load_simulation(scene, options.seed, options.world);
  for (const std::string& note : notes_of(simulation)) print_error("note: {}\n", note);
  if (simulation.terrain.whole() == nullptr) {
    // Reports insufficient memory before anything is written.
    simulation.terrain.clipmap(sensor_box(first_frame(simulation)), simulation.reach_m);
  }
  const auto warn = [](const std::string& warning) { print_error("{}\n", warning); };
  DatasetWriter dataset(out, simulation, options.use, options.part,
                        {.progress = stderr, .warn = warn});
  say_faults(out, dataset.faults());
  const FramePlan plan = plan_frames(simulation, dataset);
  log_begin(scene, out, simulation.spec.seed, options.part, plan, log);
  Tally tally;
  tally.saturated.resize(simulation.cameras.size());
  try {
    FrameProgress progress(stderr, simulation, plan);
    make_frames(
        simulation, dataset, plan.frames,
        [&](const MadeFrame& made, const WrittenFrame& written) {
          log.frame_done(count(simulation, made, written, tally));
          progress.finished(made, written);
        },
        [&](const FrameName& frame, double share) { progress.begun(frame, share); });
    if (tally.scans + tally.images == plan.frames.size()) progress.end();
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
  for (const std::string& note : saturation_notes(simulation, tally))
    print_error("note: {}\n", note);
  say(simulation, out, plan, options.part.choice, tally, log.takes_output() ? stderr : stdout);
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
