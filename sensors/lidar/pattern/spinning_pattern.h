#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "sensors/lidar/pattern/firing_cycle.h"

namespace groundray {

/// Laser of a spinning head. The head frame H is S rotated about z by the spin angle.
struct Beam {
  double elevation_rad = 0;       ///< above the x-y plane of S
  double azimuth_offset_rad = 0;  ///< from H's x axis, counter-clockwise seen from above
  glm::dvec3 origin_m{0};         ///< origin of the beam, in H
  double firing_time_s = 0;       ///< after the start of its firing sequence; less than the period
  std::uint16_t ring = 0;         ///< number that the sensor's driver gives the beam
  /// Loop in which the beam fires. Heads with several loops fire them in turn: sequence k fires the
  /// beams whose loop is k mod (the greatest loop + 1). A beam of several loops has an entry for
  /// each.
  int loop = 0;
};

/// Closed interval of azimuths, from `from_rad` counter-clockwise to `to_rad`, seen from above.
struct AzimuthInterval {
  double from_rad = 0;
  double to_rad = 0;  ///< greater than `from_rad`, by one turn at most
};

/// Pattern of a spinning lidar: a head that rotates at a constant rate and fires its beams in one
/// sequence after another. A single-plane scanner is such a head with one beam.
struct SpinningPattern {
  enum class Sense { Clockwise, CounterClockwise };  ///< seen from above
  double rate_hz = 10;                               ///< turns per second
  Sense sense = Sense::Clockwise;
  double start_azimuth_rad = 0;  ///< head's azimuth at time 0, counter-clockwise from S's x axis
  double firing_period_s = 0;    ///< from one firing sequence to the next
  std::vector<Beam> beams;
  /// Azimuths of the head, at the beginning of a sequence, at which the sequence is fired;
  /// otherwise the whole sequence is omitted. Time and loops continue in either case. All azimuths
  /// if absent.
  std::optional<AzimuthInterval> field_of_view = std::nullopt;
};

/// Pulses of a spinning lidar. Sweep n consists of the firing sequences that begin in turn n of the
/// head and are fired.
class SpinningScan {
 public:
  /// Maximum number of firing sequences in a turn of the head; the minimum is 1.
  static constexpr double most_sequences = 1e6;

  /// @throws Error listing every field of `pattern` that is out of bounds.
  explicit SpinningScan(const SpinningPattern& pattern);

  const FiringCycle& cycle() const { return cycle_; }

  /// Returns the number of the first firing sequence of a turn: 1024 sequences of 97.65625 us at
  /// 10 Hz make exactly one turn.
  std::int64_t first_sequence(std::int64_t turn) const noexcept {
    return cycle_.first_sequence(turn, rate_hz_);
  }

  double sweep_rate_hz() const { return rate_hz_; }
  std::int64_t neighbour_stride() const { return cycle_.cycle_pulses(); }
  SweepPulses runs(std::int64_t sweep) const noexcept;

 private:
  double rate_hz_;
  FiringCycle cycle_;
  // Field of view in turns of the head since the start of the current turn: [open, open + width],
  // where 0 <= open < 1 and 0 < width < 1. The whole turn if absent.
  struct Window {
    double open;
    double width;
  };
  std::optional<Window> window_;
};

/// Returns a firing from the head's centre at an azimuth and elevation; its horizontal axis points
/// counter-clockwise.
FiringCycle::Firing firing_towards(double azimuth_rad, double elevation_rad) noexcept;

}  // namespace groundray
