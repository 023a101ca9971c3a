#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "sensors/firing_cycle.h"

namespace groundray {

/// One laser of a spinning head. The head frame H is S turned about z by the spin angle.
struct Beam {
  double elevation_rad = 0;       ///< above the x-y plane of S
  double azimuth_offset_rad = 0;  ///< from H's x axis, counter-clockwise seen from above
  glm::dvec3 origin_m{0};         ///< where the beam leaves, in H
  double firing_time_s = 0;       ///< after the start of its firing sequence; less than the period
  std::uint16_t ring = 0;         ///< the number that the sensor's driver gives it
  /// Heads with several loops fire them in turn: sequence k fires the beams whose loop is k mod
  /// (the greatest loop + 1). A beam of several loops has an entry for each.
  int loop = 0;
};

/// A closed interval of azimuths, from `from_rad` counter-clockwise to `to_rad`, seen from above.
struct AzimuthInterval {
  double from_rad = 0;
  double to_rad = 0;  ///< greater than `from_rad`, by one turn at most
};

/// How a spinning lidar scans: a head that turns at a constant rate and fires its beams one
/// sequence after another. A scanner in one plane is such a head with one beam.
struct SpinningPattern {
  enum class Sense { Clockwise, CounterClockwise };  ///< seen from above
  double rate_hz = 10;                               ///< turns per second
  Sense sense = Sense::Clockwise;
  double start_azimuth_rad = 0;  ///< of the head at time 0, counter-clockwise from S's x axis
  double firing_period_s = 0;    ///< from one firing sequence to the next
  std::vector<Beam> beams;
  /// Where the head's own azimuth must be when a sequence begins, else the whole sequence is not
  /// fired; time and the loops go on. Everywhere if absent.
  std::optional<AzimuthInterval> field_of_view = std::nullopt;
};

/// The pulses of a spinning lidar. Sweep n is the firing sequences that begin in turn n of the
/// head, as far as they are fired.
class SpinningScan {
 public:
  /// A turn of the head holds from 1 to this many firing sequences.
  static constexpr double most_sequences = 1e6;

  /// @throws Error listing every field of `pattern` that is out of bounds.
  explicit SpinningScan(const SpinningPattern& pattern);

  const FiringCycle& cycle() const { return cycle_; }

  /// Returns the number of the first firing sequence of a turn: the least k >= 0 that begins when
  /// the head has made `turn` turns or more. Rates and periods are decimal figures that doubles
  /// only approximate, so a sequence up to 1e-9 turns early is on time: 1024 sequences of
  /// 97.65625 us at 10 Hz make one turn, no less and no more.
  std::int64_t first_sequence(std::int64_t turn) const noexcept;

  double sweep_rate_hz() const { return rate_hz_; }
  std::int64_t neighbour_stride() const { return cycle_.cycle_pulses(); }
  std::int64_t pulses(std::int64_t sweep) const noexcept;
  double pulse_time_s(std::int64_t sweep, std::int64_t pulse) const noexcept;
  void fill(std::int64_t sweep, NumberRange pulses, PulseBatch& batch) const noexcept;

 private:
  /// Returns the pulses of a sweep, numbered from time 0: two runs, of which one or both may be
  /// empty.
  std::array<NumberRange, 2> runs(std::int64_t sweep) const noexcept;

  double rate_hz_;
  FiringCycle cycle_;
  // The field of view in turns of the head after the start of its turn: [open, open + width], where
  // 0 <= open < 1 and 0 < width < 1. All of the turn if absent.
  struct Window {
    double open;
    double width;
  };
  std::optional<Window> window_;
};

/// Returns a shot at an azimuth and elevation from the head's centre; its horizontal axis points
/// counter-clockwise.
FiringCycle::Firing firing_towards(double azimuth_rad, double elevation_rad) noexcept;

}  // namespace groundray
