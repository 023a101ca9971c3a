#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace groundray {

/// Pulses of several rings, numbered by when they fired or where they pointed.
struct FiringLattice {
  std::vector<std::int64_t> number;  ///< of each pulse: the same in all rings at about one place
  std::vector<float> off;            ///< of each pulse: how far from its place, in steps
  double step = 0;                   ///< from number to number, in the coordinate's unit
  std::int64_t period = 0;           ///< numbers in a turn; 0 of a coordinate without turns
  double evenness = 0;  ///< of the steps of each ring: 1 if all are whole, about 0 if they are any
  double coherence =
      0;  ///< of all rings: 1 if all pulses are in place, about 0 if they are anywhere
};

/// Numbers pulses that come at equal steps, of which any may be missing. Each ring has a phase of
/// its own. A ring's step is the median of its differences, or a whole part of that if most pulses
/// are missing; where rings have several, the step of all is the coarsest that is not rare. Where
/// the rate changes along the way, or the step does not divide a turn, the phase of all rings is
/// followed.
/// @param coordinates  of each pulse, finite: azimuth or time.
/// @param rings        of each pulse, from 0 to below `ring_count`.
/// @param turn         of the coordinate, in [0, turn); 0 if it has none.
FiringLattice number_firings(std::span<const double> coordinates,
                             std::span<const std::int32_t> rings, int ring_count, double turn);

}  // namespace groundray
