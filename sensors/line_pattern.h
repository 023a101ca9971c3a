#pragma once

#include <cstdint>

#include "sensors/firing_cycle.h"

namespace groundray {

/// How a mirror sweeps one beam along lines, and a head may slowly turn the whole about z.
///
/// The mirror turns about an axis at right angles to the beam that falls on it, so the scan angle
/// is twice the mirror's own. Lines lie in a plane of the head frame H (S turned about z by the
/// head's angle) and all leave from its origin: the few millimetres by which the point of
/// reflection wanders are not modelled. Each line begins anew with a pulse.
struct LinePattern {
  /// How the scan angle goes from `from_rad` to `to_rad` in the time T = 1 / line_rate_hz of a
  /// line.
  enum class Mirror {
    Triangle,  ///< at a constant rate, back in every other line
    Sine,      ///< mean + (from - mean) cos(pi t / T): forth in one line, back in the next
    Polygon,   ///< at a constant rate, always forth: a facet sweeps 4 pi / facets in T, and the
               ///< pulses lie in the middle of it, both ends of the field of view included
  };
  enum class Plane {
    Upright,  ///< x-z of H; the angle counts from x up, so a line is a meridian of the head
    Across,   ///< y-z of H; the angle counts from straight down (-z) to the left (y)
  };
  Mirror mirror = Mirror::Triangle;
  Plane plane = Plane::Upright;
  double from_rad = 0;       ///< scan angle at which a line begins
  double to_rad = 0;         ///< and ends; less than `from_rad` for lines that run backwards
  double line_rate_hz = 0;   ///< lines per second
  double pulse_rate_hz = 0;  ///< pulses per second while a line lasts
  int facets = 0;            ///< of a polygon: 3 or more; else 0
  int lines_per_sweep = 1;
  double head_rate_hz = 0;    ///< turns per second, counter-clockwise seen from above
  double head_start_rad = 0;  ///< the head's angle at time 0, counter-clockwise from S's x axis
};

/// The pulses of a line scanner. Sweep n is `lines_per_sweep` lines from line n lines_per_sweep on.
/// The beams' horizontal axes are at right angles to an Upright line, counter-clockwise, and point
/// along an Across line, to the left.
class LineScan {
 public:
  static constexpr double most_pulses_per_line = 1e6;

  /// @throws Error listing every field of `pattern` that is out of bounds.
  explicit LineScan(const LinePattern& pattern);

  double sweep_rate_hz() const { return 1 / (cycle_.period_s() * lines_per_sweep_); }
  std::int64_t pulses_per_line() const { return pulses_per_line_; }
  /// The same pulse of the next line that runs the same way.
  std::int64_t neighbour_stride() const { return cycle_.cycle_pulses(); }
  std::int64_t pulses(std::int64_t) const noexcept { return pulses_per_line_ * lines_per_sweep_; }
  double pulse_time_s(std::int64_t sweep, std::int64_t pulse) const noexcept {
    return cycle_.pulse_time_s(sweep * pulses(sweep) + pulse);
  }
  void fill(std::int64_t sweep, NumberRange pulses, PulseBatch& batch) const noexcept;

 private:
  int lines_per_sweep_;
  FiringCycle cycle_;
  std::int64_t pulses_per_line_;
};

}  // namespace groundray
