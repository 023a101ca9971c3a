#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "core/math.h"

namespace groundray {

/// Full turn, rad.
inline constexpr double two_pi = 2 * std::numbers::pi;

/// Returns the equivalent angle from -pi to pi.
inline double wrapped(double angle_rad) {
  return angle_rad - two_pi * std::round(angle_rad / two_pi);
}

/// Complex number, whose phase is an angle.
using Phasor = std::complex<double>;

/// Returns the phasor of length 1 of an angle.
inline Phasor phasor_of(double angle_rad) { return {math::cos(angle_rad), math::sin(angle_rad)}; }

/// Returns the phase of a phasor, rad, from -pi to pi.
inline double phase_rad(const Phasor& p) { return math::atan2(p.imag(), p.real()); }

/// Returns the length of a phasor.
inline double length_of(const Phasor& p) { return std::sqrt(std::norm(p)); }

/// Returns the median of `values`, or the upper of two, and changes their order. There must be at
/// least one value.
inline double upper_median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// Pulses of several rings, numbered by the time or direction in which they fired.
struct FiringLattice {
  std::vector<std::int64_t> number;  ///< of each pulse: equal in all rings at about one coordinate
  std::vector<float> off;   ///< of each pulse: offset from its nominal coordinate, in steps
  double step = 0;          ///< between numbers, in the coordinate's unit
  std::int64_t period = 0;  ///< numbers per turn; 0 for a coordinate without turns
  /// Regularity of each ring's steps: 1 if all are whole, about 0 if they are arbitrary.
  double evenness = 0;
  /// Alignment of all rings: 1 if all pulses are at their coordinates, about 0 if at arbitrary
  /// ones.
  double coherence = 0;
};

/// Numbers pulses at equal steps, any of which may be missing. Each ring has its own phase. The
/// step of a ring is the median of its differences, or an integer fraction of it if most pulses are
/// missing. If rings differ, the common step is the coarsest that is not rare. If the rate changes
/// during the scan, or the step does not divide a turn, the common phase of all rings is tracked.
/// @param coordinates  of each pulse, finite: azimuth or time.
/// @param rings        of each pulse, from 0 to below `ring_count`.
/// @param turn         length of a turn; coordinates are then in [0, turn). 0 for no turns.
FiringLattice number_firings(std::span<const double> coordinates,
                             std::span<const std::int32_t> rings, int ring_count, double turn);

}  // namespace groundray
