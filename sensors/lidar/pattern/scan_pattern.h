#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <variant>

#include "sensors/lidar/pattern/firing_cycle.h"
#include "sensors/lidar/pattern/line_pattern.h"
#include "sensors/lidar/pattern/risley_pattern.h"
#include "sensors/lidar/pattern/spinning_pattern.h"
#include "sensors/lidar/pattern/table_pattern.h"

namespace groundray {

/// Scan pattern of a lidar.
using PatternSpec = std::variant<SpinningPattern, LinePattern, RisleyPattern, TablePattern>;

/// Pulses of a lidar, indefinitely from time 0, divided into sweeps; within a sweep they are
/// numbered from 0 in firing order. Immutable and therefore thread-safe.
class ScanPattern {
 public:
  /// @throws Error listing every field of `pattern` that is out of bounds.
  explicit ScanPattern(const PatternSpec& pattern);

  /// Returns the mean number of sweeps per second.
  double sweep_rate_hz() const;
  /// Returns the number of pulses of a sweep, at least one.
  /// @param sweep  >= 0, as in all functions here.
  std::int64_t pulses(std::int64_t sweep) const noexcept;
  /// Returns a stride for coherent packets of rays: pulse i + neighbour_stride() has nearly the
  /// direction of pulse i. It leads to the same shot of the next firing sequence in patterns that
  /// have such sequences.
  std::int64_t neighbour_stride() const noexcept;

  /// Replaces the contents of `batch` by pulses [begin, end) of a sweep. Any division of a sweep
  /// into ranges gives the same pulses, bit for bit; a volley that is divided appears in both
  /// ranges.
  /// @param begin, end  0 <= begin <= end <= pulses(sweep)
  void fill(std::int64_t sweep, std::int64_t begin, std::int64_t end, PulseBatch& batch) const;

  /// Returns the stamp of a sweep: the time of its first firing since time 0, to the nearest
  /// nanosecond.
  std::chrono::nanoseconds stamp(std::int64_t sweep) const noexcept;
  /// Returns the time of a sweep's last firing since time 0, to the nearest nanosecond.
  std::chrono::nanoseconds last_firing(std::int64_t sweep) const noexcept;

 private:
  SweepPulses runs(std::int64_t sweep) const noexcept;
  std::chrono::nanoseconds pulse_time(std::int64_t sweep, std::int64_t pulse) const noexcept;

  // Each has its cycle of firings, the pulses of a sweep as runs(), sweep_rate_hz() and
  // neighbour_stride().
  using Scan = std::variant<SpinningScan, LineScan, RisleyScan, TableScan>;

  Scan scan_;
};

}  // namespace groundray
