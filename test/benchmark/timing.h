#pragma once

#include <chrono>
#include <ctime>

namespace groundray::benchmark {

using Clock = std::chrono::steady_clock;

/// Returns how long ago a time was, in seconds.
inline double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Returns the seconds of processors that all threads of this program have taken.
inline double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Returns those that `act` takes.
template <typename Act>
double processor_s_of(const Act& act) {
  const double begin_s = processor_s();
  act();
  return processor_s() - begin_s;
}

}  // namespace groundray::benchmark
