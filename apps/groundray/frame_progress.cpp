#include "apps/groundray/frame_progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

namespace groundray {

FrameProgress::FrameProgress(std::FILE* out, const Simulation& simulation, const FramePlan& plan)
    : lidars_(simulation.lidars.size()),
      sensors_(lidars_ + simulation.cameras.size()),
      shown_(out, "frames", plan.frames.size()) {
  for (const FrameName& name : plan.frames) ++sensors_[name.sensor].asked_for;
}

void FrameProgress::begun(const FrameName& frame, double share) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;  // another thread reports the same
  current_ = frame;
  current_share_ = share;
  shown_.show([this] { return line(); });
}

void FrameProgress::finished(const MadeFrame& made, const WrittenFrame& written) {
  const double cores = std::max(1U, std::thread::hardware_concurrency());
  const std::lock_guard lock(mutex_);
  Sensor& sensor = sensors_[made.name.sensor];
  ++sensor.done;
  sensor.spent += made.making + written.writing_cpu / cores;
  if (current_.sensor == made.name.sensor && current_.number == made.name.number)
    current_share_ = 0;
  shown_.show([this] { return line(); });
}

void FrameProgress::end() {
  const std::lock_guard lock(mutex_);
  shown_.end(counts(true));
}

std::string FrameProgress::counts(bool ends) const {
  std::string text;
  const auto add = [&](const char* kind, std::size_t from, std::size_t to, bool is_current) {
    std::uint64_t done = 0, asked_for = 0;
    for (std::size_t i = from; i < to; ++i) {
      done += sensors_[i].done;
      asked_for += sensors_[i].asked_for;
    }
    if (asked_for == 0) return;
    text += fmt::format("{}{} {}/{}", text.empty() ? "" : ", ", kind, done, asked_for);
    if (is_current && !ends && current_share_ > 0)
      text += fmt::format(" ({:.0f} % of the next)", 100 * current_share_);
  };
  add("scans", 0, lidars_, false);
  add("images", lidars_, sensors_.size(), current_.sensor >= lidars_);
  return text.empty() ? "no frames left to make" : text;
}

std::string FrameProgress::line() const { return counts(false) + left(); }

std::string FrameProgress::left() const {
  std::chrono::duration<double> left{0};
  for (const Sensor& sensor : sensors_) {
    if (sensor.done == sensor.asked_for) continue;
    if (sensor.done == 0) return "";  // how long its frames take is not known yet
    const std::chrono::duration<double> each = sensor.spent / static_cast<double>(sensor.done);
    left += each * static_cast<double>(sensor.asked_for - sensor.done);
    if (&sensor == &sensors_[current_.sensor]) left -= each * current_share_;
  }
  return fmt::format(", {} left", duration_text(std::max(left, std::chrono::duration<double>(0))));
}

}  // namespace groundray
