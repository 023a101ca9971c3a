#pragma once

#include <cstddef>
#include <functional>
#include <limits>

namespace groundray {

/// Progress callback and memory limit of a computation.
struct RunControl {
  /// Called from time to time, by one thread at a time, with the fraction that is done, 0 to 1. An
  /// exception that it throws ends the computation and reaches the caller.
  std::function<void(double share)> progress;
  /// Memory limit: a computation that needs more is not begun; an Error states its requirement.
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();

  /// Calls `progress`, if there is one.
  void report(double share) const {
    if (progress) progress(share);
  }
};

}  // namespace groundray
