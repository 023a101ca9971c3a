#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>

#include "apps/scene/interruption.h"
#include "core/progress.h"

namespace groundray {

/// Progress display for the certification of a terrain; shows nothing if there is none. Stops the
/// certification on interruption.
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
