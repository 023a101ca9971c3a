#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "apps/scene/interruption.h"
#include "core/progress.h"
#include "reconstruction/pipeline/stages.h"

namespace groundray {

/// Shows the progress of a reconstruction, with a line for each stage, and stops it on
/// interruption.
class StageProgress {
 public:
  explicit StageProgress(std::string unit = "percent", std::uint64_t steps = 100)
      : unit_(std::move(unit)), steps_(steps) {}

  /// Returns a control that reports to this, which must outlive it.
  PipelineControl control(std::size_t most_bytes) {
    return {.progress = [this](const char* stage, double share) { update(stage, share); },
            .most_bytes = most_bytes};
  }

  /// Shows the fraction of a stage that is done, 0 to 1.
  /// @throws Interrupted.
  void update(const std::string& stage, double share) {
    stop_if_interrupted();
    if (!progress_ || stage != stage_) progress_.emplace(stderr, stage + ", " + unit_, steps_);
    stage_ = stage;
    progress_->update(static_cast<std::uint64_t>(share * static_cast<double>(steps_)));
  }

 private:
  std::string unit_, stage_;
  std::uint64_t steps_;
  std::optional<Progress> progress_;
};

}  // namespace groundray
