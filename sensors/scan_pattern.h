#pragma once

#include <chrono>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

namespace groundray {

/// One laser of a spinning head. The head frame H is S turned about z by the spin angle.
struct Beam {
  double elevation_rad = 0;       ///< above the x-y plane of S
  double azimuth_offset_rad = 0;  ///< from H's x axis, counter-clockwise seen from above
  glm::dvec3 origin_m{0};         ///< where the beam leaves, in H
  double firing_time_s = 0;       ///< after the start of its firing sequence; less than the period
  std::uint16_t ring = 0;         ///< the number that the sensor's driver gives it
};

/// How a spinning lidar scans: a head that turns at a constant rate and fires its beams one
/// sequence after another.
struct SpinningPattern {
  enum class Sense { Clockwise, CounterClockwise };  ///< seen from above
  double rate_hz = 10;                               ///< turns per second
  Sense sense = Sense::Clockwise;
  double start_azimuth_rad = 0;  ///< of the head at time 0, counter-clockwise from S's x axis
  double firing_period_s = 0;    ///< from one firing sequence to the next
  std::vector<Beam> beams;
};

/// The pulses of a spinning lidar, numbered without end from time 0: firing sequence after firing
/// sequence, and in each one beam after beam in order of firing time. Sweep n is the firing
/// sequences that begin in turn n of the head.
class ScanPattern {
 public:
  /// Beams that fire at the same moment.
  struct Volley {
    double firing_time_s = 0;
    int begin = 0;  ///< index of the first beam, in firing order
    int end = 0;    ///< past the last
  };
  /// A beam in firing order: what is needed to cast it from the head.
  struct Shot {
    glm::dvec3 direction{1, 0, 0};  ///< unit, in H
    glm::dvec3 origin_m{0};         ///< in H
    std::uint16_t ring = 0;
  };

  /// A turn of the head holds from 1 to this many firing sequences.
  static constexpr double most_sequences = 1e6;

  /// @throws Error listing every field of `pattern` that is out of bounds.
  explicit ScanPattern(const SpinningPattern& pattern);

  std::span<const Shot> shots() const { return shots_; }
  std::span<const Volley> volleys() const { return volleys_; }

  /// Returns the number of the first firing sequence of a sweep: the least k >= 0 that begins when
  /// the head has made `sweep` turns or more. Rates and periods are decimal figures that doubles
  /// only approximate, so a sequence up to 1e-9 turns early is on time: 1024 sequences of
  /// 97.65625 us at 10 Hz make one turn, no less and no more.
  std::int64_t first_sequence(std::int64_t sweep) const;
  /// Returns when a volley of a sequence fires: seconds since time 0.
  double firing_time_s(std::int64_t sequence, const Volley& volley) const {
    return static_cast<double>(sequence) * firing_period_s_ + volley.firing_time_s;
  }
  /// Returns the head's spin angle at a time, counter-clockwise from S's x axis, in [0, 2 pi).
  double spin_rad(double time_s) const;

  /// The stamp of a sweep: its first firing, since time 0, to the nearest nanosecond.
  std::chrono::nanoseconds stamp(std::int64_t sweep) const;
  /// When the last beam of a sweep fires, since time 0, to the nearest nanosecond.
  std::chrono::nanoseconds last_firing(std::int64_t sweep) const;

 private:
  double rate_hz_;
  double signed_rate_hz_;
  double start_azimuth_rad_;
  double firing_period_s_;
  std::vector<Shot> shots_;
  std::vector<Volley> volleys_;
};

}  // namespace groundray
