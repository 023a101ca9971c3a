#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "sensors/lidar/pattern/pulse_batch.h"

namespace groundray {

/// Half-open range [begin, end) of numbers of pulses or sequences.
struct NumberRange {
  std::int64_t begin = 0;
  std::int64_t end = 0;
};

/// Rotation of a head about z: its angle is that at time 0 plus 2 pi times the number of turns. A
/// rate of 0 represents a fixed head.
struct HeadTurn {
  double rate_hz = 0;    ///< turns per second, counter-clockwise seen from above
  double start_rad = 0;  ///< angle at time 0, counter-clockwise from S's x axis

  /// Returns the head's angle at a time, counter-clockwise from S's x axis, in [0, 2 pi). Its
  /// accuracy does not depend on the number of turns.
  double angle_rad(double time_s) const noexcept;
};

/// Returns the fractional part of rate_hz * time_s, in [0, 1); it may be negative by a rounding
/// error. The product is not rounded before the whole turns are subtracted.
double turn_fraction(double rate_hz, double time_s) noexcept;

/// Engine of every pattern that repeats in a head frame H, which is S rotated about z: a cycle of
/// one or more firing sequences that follow each other at a constant period, indefinitely. Pulses
/// and sequences are numbered from time 0.
class FiringCycle {
 public:
  /// Direction, origin and ring of one pulse of the cycle.
  struct Shot {
    glm::dvec3 direction{1, 0, 0};  ///< unit, in H
    glm::dvec3 origin_m{0};         ///< in H
    std::uint16_t ring = 0;
  };
  /// Shots that fire at the same instant.
  struct Volley {
    double firing_time_s = 0;  ///< after the start of its sequence
    int begin = 0;             ///< index of the first shot, in firing order
    int end = 0;               ///< index past the last shot
    int sequence = 0;          ///< its number within the cycle
  };
  /// Shot of one sequence of the cycle, before it is sorted into firing order.
  struct Firing {
    int sequence = 0;
    double firing_time_s = 0;
    Shot shot;
    glm::dvec3 horizontal{0, 1, 0};  ///< horizontal axis, in H (see PulseBatch)
  };

  /// @param firings  in any order; shots of equal time keep their order. Each sequence of the
  ///        cycle, from 0 to the greatest, must have at least one.
  FiringCycle(std::vector<Firing> firings, double period_s, const HeadTurn& head);

  std::span<const Shot> shots() const { return shots_; }
  std::span<const Volley> volleys() const { return volleys_; }
  const HeadTurn& head() const { return head_; }
  double period_s() const { return period_s_; }
  /// Returns the number of pulses in a whole cycle.
  std::int64_t cycle_pulses() const { return static_cast<std::int64_t>(shots_.size()); }

  /// Returns the number of pulses before a sequence.
  std::int64_t pulses_before(std::int64_t sequence) const noexcept;
  /// Returns the time at which a volley of a sequence fires, s since time 0.
  double firing_time_s(std::int64_t sequence, const Volley& volley) const noexcept {
    return static_cast<double>(sequence) * period_s_ + volley.firing_time_s;
  }
  /// Returns the time at which a pulse fires, s since time 0.
  double pulse_time_s(std::int64_t pulse) const noexcept;

  /// Writes pulses [begin, end) to the rows of `batch` from `row` on, and appends their volleys. A
  /// volley that the range cuts is written in part.
  void fill(NumberRange pulses, PulseBatch& batch, std::size_t row) const noexcept;

 private:
  struct Place {
    std::int64_t cycle;
    std::size_t volley;
    int shot;
  };
  Place place_of(std::int64_t pulse) const noexcept;
  double time_s(std::int64_t cycle, const Volley& volley) const noexcept {
    return firing_time_s(cycle * sequences() + volley.sequence, volley);
  }
  std::int64_t sequences() const { return static_cast<std::int64_t>(first_shot_.size()); }

  double period_s_;
  HeadTurn head_;
  double fixed_cos_, fixed_sin_;  // cosine and sine of a fixed head's angle
  std::vector<Shot> shots_;
  std::vector<glm::dvec3> horizontal_;  // by shot
  std::vector<Volley> volleys_;
  std::vector<int> first_shot_;  // by sequence of the cycle
};

}  // namespace groundray
