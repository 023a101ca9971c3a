#include "apps/groundray/frame_progress.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>

namespace groundray {
namespace {

using std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

double rays_of(const PlacedLidar& lidar) {
  return static_cast<double>(lidar.lidar.pattern().pulses(0)) *
         static_cast<double>(lidar.spec.lidar.beam.sub_rays);
}

double rays_of(const PlacedCamera& placed) {
  const CameraSpec& camera = placed.spec.camera;
  const double per_pixel =
      needs_light(camera) ? camera.sampling.samples * camera.sampling.depth : 0;
  return (1 + per_pixel) * camera.size_px.x * camera.size_px.y;
}

}  // namespace

FrameProgress::FrameProgress(std::FILE* out, const Simulation& simulation, const FramePlan& plan)
    : lidars_(simulation.lidars.size()), shown_(out, "frames", plan.frames.size()) {
  for (const PlacedLidar& lidar : simulation.lidars) sensors_.push_back({.rays = rays_of(lidar)});
  for (const PlacedCamera& camera : simulation.cameras)
    sensors_.push_back({.rays = rays_of(camera)});
  for (const FrameName& name : plan.frames) ++sensors_[name.sensor].asked_for;
}

void FrameProgress::begun(const FrameName& frame, double share) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;  // another thread reports the same
  if (current_.sensor != frame.sensor || current_.number != frame.number || current_share_ == 0)
    current_begin_ = steady_clock::now();
  current_ = frame;
  current_share_ = share;
  shown_.show([this] { return counts() + left(); });
}

void FrameProgress::finished(const MadeFrame& made, const WrittenFrame& written) {
  const auto cores = static_cast<double>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  const std::lock_guard lock(mutex_);
  Sensor& sensor = sensors_[made.name.sensor];
  ++sensor.done;
  sensor.spent += made.making + written.writing_cpu / cores;
  if (current_.sensor == made.name.sensor && current_.number == made.name.number)
    current_share_ = 0;
  shown_.show([this] { return counts() + left(); });
}

void FrameProgress::end() {
  const std::lock_guard lock(mutex_);
  current_share_ = 0;
  shown_.end(counts());
}

std::string FrameProgress::counts() const {
  std::string text;
  const auto add = [&](const char* kind, std::span<const Sensor> sensors) {
    std::uint64_t done = 0, asked_for = 0;
    for (const Sensor& sensor : sensors) {
      done += sensor.done;
      asked_for += sensor.asked_for;
    }
    if (asked_for > 0)
      text += fmt::format("{}{} {}/{}", text.empty() ? "" : ", ", kind, done, asked_for);
  };
  add("scans", lidars());
  add("images", cameras());
  if (current_share_ > 0 && current_.sensor >= lidars_)
    text += fmt::format(" ({:.0f} % of the next)", 100 * current_share_);
  return text.empty() ? "no frames are left to make" : text;
}

std::string FrameProgress::left() const {
  const Seconds current = steady_clock::now() - current_begin_;
  Seconds left{0};
  for (const std::span<const Sensor> kind : {lidars(), cameras()}) {
    Seconds spent{0};
    double rays = 0;
    for (const Sensor& sensor : kind) {
      spent += sensor.spent;
      rays += static_cast<double>(sensor.done) * sensor.rays;
      if (&sensor != &sensors_[current_.sensor] || current_share_ == 0) continue;
      spent += current;
      rays += current_share_ * sensor.rays;
    }
    for (const Sensor& sensor : kind) {
      if (sensor.done == sensor.asked_for) continue;
      if (rays == 0) return "";  // nothing of this kind has begun
      const Seconds each = sensor.done > 0 ? sensor.spent / static_cast<double>(sensor.done)
                                           : spent * (sensor.rays / rays);
      left += each * static_cast<double>(sensor.asked_for - sensor.done);
      if (&sensor == &sensors_[current_.sensor]) left -= each * current_share_;
    }
  }
  return fmt::format(", {} left", duration_text(std::max(left, Seconds(0))));
}

}  // namespace groundray
