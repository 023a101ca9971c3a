#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "apps/scene/interruption.h"
#include "core/progress.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Step of a reconstruction: shows its progress, and stops on interruption.
class Stage {
 public:
  explicit Stage(const std::string& label) : progress_(stderr, label + ", percent", steps) {}

  /// Returns work options that report progress to this stage; they must not outlive it.
  RunControl work(std::size_t most_bytes) {
    return {.progress = [this](double share) { update(share); }, .most_bytes = most_bytes};
  }

  void update(double share) {
    stop_if_interrupted();
    progress_.update(static_cast<std::uint64_t>(share * steps));
  }

 private:
  static constexpr std::uint64_t steps = 100;
  Progress progress_;
};

/// Appends the duration of a stage to a report's list when it ends.
class StageTimer {
 public:
  using Durations = std::vector<std::pair<std::string, double>>;  // name, seconds

  StageTimer(Durations& durations, std::string stage)
      : durations_(durations), stage_(std::move(stage)) {}
  ~StageTimer() {
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin_;
    durations_.emplace_back(std::move(stage_), spent.count());
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  Durations& durations_;
  std::string stage_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace groundray
