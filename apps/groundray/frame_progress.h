#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "apps/dataset/write/frame_maker.h"
#include "apps/scene/simulation.h"
#include "core/progress.h"

namespace groundray {

/// Progress of a run by kind of product: `scans 12/20, images 1/3 (45 % of the next), 40 s left`.
/// The time left counts the frames of each sensor at the pace of those that are finished; before a
/// sensor's first frame, at that of the other lidars or cameras, in proportion to the rays of a
/// frame. Any number of threads may use it.
class FrameProgress {
 public:
  /// @param out  stream to report to; must outlive this.
  FrameProgress(std::FILE* out, const Simulation& simulation, const FramePlan& plan);

  /// Records the fraction of a frame that has begun.
  void begun(const FrameName& frame, double share);
  /// Records a frame that is finished.
  void finished(const MadeFrame& made, const WrittenFrame& written);
  /// Shows the last line.
  void end();

 private:
  struct Sensor {
    double rays = 0;  // of a frame
    std::uint64_t asked_for = 0, done = 0;
    std::chrono::duration<double> spent{0};
  };

  std::string counts() const;
  std::string left() const;
  std::span<const Sensor> lidars() const { return std::span(sensors_).first(lidars_); }
  std::span<const Sensor> cameras() const { return std::span(sensors_).subspan(lidars_); }

  std::size_t lidars_;
  std::vector<Sensor> sensors_;
  FrameName current_;
  double current_share_ = 0;
  std::chrono::steady_clock::time_point current_begin_;
  std::mutex mutex_;
  Progress shown_;
};

}  // namespace groundray
