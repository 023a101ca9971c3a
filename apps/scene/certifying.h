#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>

#include "apps/interruption.h"
#include "core/progress.h"

namespace groundray {

/// Says how far the certification of a terrain is, nothing as long as there is none; and stops it
/// when asked to.
class Certifying {
 public:
  void update(double share) {
    stop_if_interrupted();
    constexpr std::uint64_t steps = 1000;
    if (!progress_) progress_.emplace(stderr, "certifying the terrain, per mille", steps);
    progress_->update(static_cast<std::uint64_t>(share * steps));
  }

 private:
  std::optional<Progress> progress_;
};

}  // namespace groundray
