#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace groundray {

/// Pulses in firing order, one array per quantity. Reuse a batch: it allocates nothing once it has
/// held as many pulses.
struct PulseBatch {
  /// Pulses that fire at the same instant.
  struct Volley {
    double time_s = 0;  ///< since time 0
    std::size_t begin = 0;
    std::size_t end = 0;
  };

  std::vector<Volley> volleys;
  std::vector<glm::dvec3> direction;  ///< unit, in S
  std::vector<glm::dvec3> origin_m;   ///< origin of the beam, in S
  /// Direction of the beam's horizontal width: a unit vector in S, perpendicular to `direction`. It
  /// points towards increasing azimuth unless the pattern states otherwise.
  std::vector<glm::dvec3> horizontal;
  std::vector<std::uint16_t> ring;

  std::size_t size() const { return direction.size(); }

  /// Resizes the batch to `count` pulses, whose values are then unspecified, and clears the
  /// volleys.
  void reset(std::size_t count) {
    volleys.clear();
    direction.resize(count);
    origin_m.resize(count);
    horizontal.resize(count);
    ring.resize(count);
  }
};

/// Half-open range [begin, end) of numbers of pulses or sequences.
struct NumberRange {
  std::int64_t begin = 0;
  std::int64_t end = 0;
};

/// Pulses of a sweep, numbered from time 0, as two ranges; one or both may be empty.
using SweepPulses = std::array<NumberRange, 2>;

/// Returns the fraction of a turn by which a firing sequence may be early at `turns` turns: rates
/// and periods are decimal figures that doubles only approximate. It is 1e-9 and the rounding
/// errors of rate, period, their product and the quotient.
double slack_turns(double turns) noexcept;

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

  /// Returns the number of the first sequence that begins after `turn` turns at a rate, or early by
  /// slack_turns() at most; at least 0.
  std::int64_t first_sequence(std::int64_t turn, double rate_hz) const noexcept;
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
  void fill(NumberRange pulses, PulseBatch& batch, std::size_t row) const;

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
