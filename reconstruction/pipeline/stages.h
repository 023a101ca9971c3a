#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "reconstruction/run_control.h"

namespace groundray {

/// Progress callback and memory limit of a computation in several stages.
struct PipelineControl {
  /// Called as RunControl::progress, with the stage in progress: "merging". Each stage begins with
  /// the fraction 0 and, if it succeeds, ends with 1.
  std::function<void(const char* stage, double share)> progress;
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();  ///< limit of each stage
};

/// Names of stages and their durations, s.
using StageSeconds = std::vector<std::pair<std::string, double>>;

/// Appends a stage to a list, and sets its duration when it ends.
class StageTimer {
 public:
  StageTimer(StageSeconds& seconds, std::string stage) : seconds_(seconds), at_(seconds.size()) {
    seconds.emplace_back(std::move(stage), 0);  // here, because destructors must not allocate
  }
  ~StageTimer() {
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin_;
    seconds_[at_].second = spent.count();
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  StageSeconds& seconds_;
  std::size_t at_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Names of a stage: of its duration ("merge") and of its progress ("merging").
struct StageName {
  const char* duration;
  const char* progress;
};

/// Returns the result of `step`, which gets a RunControl, and records progress and duration.
template <typename Step>
auto run_stage(const StageName& name, const PipelineControl& control, StageSeconds& seconds,
               const Step& step) {
  const StageTimer timer(seconds, name.duration);
  const auto report = [&](double share) {
    if (control.progress) control.progress(name.progress, share);
  };
  report(0);
  auto result = step(RunControl{.progress = report, .most_bytes = control.most_bytes});
  report(1);
  return result;
}

}  // namespace groundray
