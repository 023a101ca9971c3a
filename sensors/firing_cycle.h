#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "sensors/pulse_batch.h"

namespace groundray {

/// A closed range of pulses or sequences without its end.
struct NumberRange {
  std::int64_t begin = 0;
  std::int64_t end = 0;
};

/// How a head turns about z: its angle is that at time 0 plus 2 pi times turns. A rate of 0 stands
/// for a head that is fixed.
struct HeadTurn {
  double rate_hz = 0;    ///< turns per second, counter-clockwise seen from above
  double start_rad = 0;  ///< at time 0, counter-clockwise from S's x axis

  /// Returns the head's angle at a time, counter-clockwise from S's x axis, in [0, 2 pi). It does
  /// not lose accuracy with the number of turns.
  double angle_rad(double time_s) const noexcept;
};

/// The fraction of a turn, in [-1/2, 1/2], by which 2 pi rate_hz time_s differs from whole turns:
/// the product is not rounded before the whole turns are gone.
double turn_fraction(double rate_hz, double time_s) noexcept;

/// The engine of every pattern that repeats in a head frame H, which is S turned about z: a cycle
/// of one or more firing sequences that follow each other at a constant period for ever. Pulses and
/// sequences are numbered from time 0.
class FiringCycle {
 public:
  /// What is needed to cast a pulse from the head.
  struct Shot {
    glm::dvec3 direction{1, 0, 0};  ///< unit, in H
    glm::dvec3 origin_m{0};         ///< in H
    std::uint16_t ring = 0;
  };
  /// Shots that fire at the same moment.
  struct Volley {
    double firing_time_s = 0;  ///< after the start of its sequence
    int begin = 0;             ///< index of the first shot, in firing order
    int end = 0;               ///< past the last
    int sequence = 0;          ///< of the cycle
  };
  /// A shot of one sequence of the cycle, not yet in firing order.
  struct Firing {
    int sequence = 0;
    double firing_time_s = 0;
    Shot shot;
    glm::dvec3 horizontal{0, 1, 0};  ///< see PulseBatch; in H
  };

  /// @param firings  in any order; shots of equal time keep it. Each sequence of the cycle, from 0
  ///                 to the greatest, must have one.
  FiringCycle(std::vector<Firing> firings, double period_s, const HeadTurn& head);

  std::span<const Shot> shots() const { return shots_; }
  std::span<const Volley> volleys() const { return volleys_; }
  const HeadTurn& head() const { return head_; }
  double period_s() const { return period_s_; }
  /// The number of pulses in a whole cycle.
  std::int64_t cycle_pulses() const { return static_cast<std::int64_t>(shots_.size()); }

  /// Returns the number of pulses before a sequence.
  std::int64_t pulses_before(std::int64_t sequence) const noexcept;
  /// Returns when a volley of a sequence fires: seconds since time 0.
  double firing_time_s(std::int64_t sequence, const Volley& volley) const noexcept {
    return static_cast<double>(sequence) * period_s_ + volley.firing_time_s;
  }
  /// Returns when a pulse fires: seconds since time 0.
  double pulse_time_s(std::int64_t pulse) const noexcept;

  /// Writes pulses [begin, end) to the rows of `batch` from `row` on. A range that cuts a volley
  /// gives a part of it.
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
  double fixed_cos_, fixed_sin_;  // of a head that does not turn
  std::vector<Shot> shots_;
  std::vector<glm::dvec3> horizontal_;  // of each shot
  std::vector<Volley> volleys_;
  std::vector<int> first_shot_;  // of each sequence of the cycle
};

}  // namespace groundray
