#pragma once

#include <cstddef>
#include <functional>
#include <limits>

namespace groundray {

/// How long work reports and what it may take.
struct Work {
  /// Called now and then, by one thread at a time, with the share that is done, 0 to 1. What it
  /// throws ends the work and reaches the caller.
  std::function<void(double share)> progress;
  /// More than this is not begun: an Error tells how much it would take.
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();
};

}  // namespace groundray
