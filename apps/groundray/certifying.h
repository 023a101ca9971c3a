#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>

#include "core/progress.h"

namespace groundray {

/// Says how far the certification of a terrain is; nothing as long as there is none.
class Certifying {
 public:
  void update(double share) {
    constexpr std::uint64_t steps = 1000;
    if (!progress_) progress_.emplace(stderr, "certifying the terrain, per mille", steps);
    progress_->update(static_cast<std::uint64_t>(share * steps));
  }

 private:
  std::optional<Progress> progress_;
};

}  // namespace groundray
