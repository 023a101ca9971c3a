#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>

#include "apps/interruption.h"
#include "core/progress.h"
#include "reconstruction/work.h"

namespace groundray {

/// One of the steps that a reconstruction takes: says how far it is, and stops when asked to.
class Stage {
 public:
  explicit Stage(const std::string& label) : progress_(stderr, label + ", percent", steps) {}

  /// Returns what the library is to report to; not for longer than this lives.
  Work work(std::size_t most_bytes) {
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

}  // namespace groundray
