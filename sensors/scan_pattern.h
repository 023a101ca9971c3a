#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <variant>

#include "sensors/firing_cycle.h"
#include "sensors/line_pattern.h"
#include "sensors/pulse_batch.h"
#include "sensors/risley_pattern.h"
#include "sensors/spinning_pattern.h"
#include "sensors/table_pattern.h"

namespace groundray {

/// How a lidar scans.
using PatternSpec = std::variant<SpinningPattern, LinePattern, RisleyPattern, TablePattern>;

/// The pulses of a lidar without end from time 0, cut into sweeps; within a sweep they are numbered
/// from 0 in firing order. Immutable, so any number of threads may read one.
class ScanPattern {
 public:
  /// @throws Error listing every field of `pattern` that is out of bounds.
  explicit ScanPattern(const PatternSpec& pattern);

  /// How many sweeps there are in a second, on average.
  double sweep_rate_hz() const;
  /// Returns the number of pulses of a sweep, at least one. @param sweep  >= 0, as everywhere here.
  std::int64_t pulses(std::int64_t sweep) const noexcept;
  /// A hint for coherent packets of rays: pulse i + neighbour_stride() points nearly where pulse i
  /// does. The same shot of successive firing sequences, where there are such.
  std::int64_t neighbour_stride() const noexcept;

  /// Puts pulses [begin, end) of a sweep into `batch`, in place of what it held. Any way to cut a
  /// sweep into ranges gives the same pulses, bit for bit; a volley that is cut appears in both.
  /// @param begin, end  0 <= begin <= end <= pulses(sweep)
  void fill(std::int64_t sweep, std::int64_t begin, std::int64_t end,
            PulseBatch& batch) const noexcept;

  /// The stamp of a sweep: its first firing, since time 0, to the nearest nanosecond.
  std::chrono::nanoseconds stamp(std::int64_t sweep) const noexcept;
  /// When the last pulse of a sweep fires, since time 0, to the nearest nanosecond.
  std::chrono::nanoseconds last_firing(std::int64_t sweep) const noexcept;

 private:
  using Scan = std::variant<SpinningScan, LineScan, RisleyScan, TableScan>;

  Scan scan_;
};

}  // namespace groundray
