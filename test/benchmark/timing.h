#pragma once

#include <chrono>
#include <ctime>

namespace groundray::benchmark {

using Clock = std::chrono::steady_clock;

/// Returns the time elapsed since a time point, s.
inline double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Returns the CPU time of all threads of this process, s.
inline double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Returns the CPU time that `act` takes, s.
template <typename Act>
double processor_s_of(const Act& act) {
  const double begin_s = processor_s();
  act();
  return processor_s() - begin_s;
}

}  // namespace groundray::benchmark
