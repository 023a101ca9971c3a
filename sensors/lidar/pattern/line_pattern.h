#pragma once

#include <cstdint>

#include "sensors/lidar/pattern/firing_cycle.h"

namespace groundray {

/// Line scanner: a mirror sweeps one beam along lines; a head may slowly rotate it about z.
///
/// The mirror rotates about an axis perpendicular to the incident beam, so the scan angle is twice
/// the mirror's own angle. Lines lie in a plane of the head frame H (S rotated about z by the
/// head's angle). All pulses leave from the origin of H: the displacement of the point of
/// reflection by a few millimetres is not modelled. Each line starts its own series of pulses.
struct LinePattern {
  /// Motion of the scan angle from `from_rad` to `to_rad` in the time T = 1 / line_rate_hz of a
  /// line.
  enum class Mirror {
    Triangle,  ///< at a constant rate; every other line runs backwards
    Sine,      ///< mean + (from - mean) cos(pi t / T); every other line runs backwards
    /// At a constant rate; all lines run forwards. A facet sweeps 4 pi / facets in T, and the
    /// pulses lie in the middle of T, over the field of view including both ends.
    Polygon,
  };
  /// Plane of the lines, and the angle in it.
  enum class Plane {
    Upright,  ///< x-z of H; the angle counts from x upwards, so a line is a meridian of the head
    Across,   ///< y-z of H; the angle counts from straight down (-z) to the left (y)
  };
  Mirror mirror = Mirror::Triangle;
  Plane plane = Plane::Upright;
  double from_rad = 0;       ///< scan angle at which a line begins
  double to_rad = 0;         ///< scan angle at which it ends; may be less than `from_rad`
  double line_rate_hz = 0;   ///< lines per second
  double pulse_rate_hz = 0;  ///< pulses per second during a line
  int facets = 0;            ///< facets of a polygon: 3 or more; 0 for other mirrors
  int lines_per_sweep = 1;
  double head_rate_hz = 0;    ///< turns per second, counter-clockwise seen from above
  double head_start_rad = 0;  ///< the head's angle at time 0, counter-clockwise from S's x axis
};

/// Pulses of a line scanner. Sweep n consists of `lines_per_sweep` lines, starting with line
/// n * lines_per_sweep. The beams' horizontal axes are perpendicular to an Upright line,
/// counter-clockwise, and parallel to an Across line, to the left.
class LineScan {
 public:
  static constexpr double most_pulses_per_line = 1e6;

  /// @throws Error listing every field of `pattern` that is out of bounds.
  explicit LineScan(const LinePattern& pattern);

  const FiringCycle& cycle() const { return cycle_; }
  double sweep_rate_hz() const { return 1 / (cycle_.period_s() * lines_per_sweep_); }
  /// Returns the number of pulses up to the same pulse of the next line in the same direction.
  std::int64_t neighbour_stride() const { return cycle_.cycle_pulses(); }
  SweepPulses runs(std::int64_t sweep) const noexcept {
    const std::int64_t pulses = pulses_per_line_ * lines_per_sweep_;
    return {{{sweep * pulses, (sweep + 1) * pulses}, {}}};
  }

 private:
  int lines_per_sweep_;
  FiringCycle cycle_;
  std::int64_t pulses_per_line_;
};

}  // namespace groundray
