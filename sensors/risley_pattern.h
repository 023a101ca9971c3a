#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "sensors/firing_cycle.h"
#include "sensors/spinning_pattern.h"

namespace groundray {

/// A wedge of glass that turns about S's x axis. One of its faces is at right angles to x, the
/// other is tilted by the wedge angle. Where the glass is thickest is its base; light bends towards
/// it.
struct WedgePrism {
  enum class Tilted { Exit, Entry };  ///< which face, as the light goes
  double wedge_rad = 0;
  double refractive_index = 1.5;  ///< relative to the air
  double rate_hz = 0;   ///< turns per second, from y to z: counter-clockwise seen against the light
  double base_rad = 0;  ///< of the base at time 0: from y towards z
  Tilted tilted = Tilted::Exit;
};

/// Beams that pass up to three rotating prisms (Risley prisms), each along x before the first one
/// but for the beam's own angles. Rates without a common measure draw a rosette that never repeats.
/// Beams leave from S's origin: the centimetres by which they wander in the prisms are not
/// modelled.
/// @see Li, Liu and Sun, Forward and inverse solutions for three-element Risley prism beam scanners
///      (2017), doi:10.1364/OE.25.007677
struct RisleyPattern {
  std::vector<WedgePrism> prisms;
  /// As they fall on the first prism; firing times and rings as in a spinning head. Loops and
  /// origins must be 0.
  std::vector<Beam> beams;
  double firing_period_s = 0;  ///< from one firing sequence to the next
  double sweep_rate_hz = 10;
};

/// The pulses of a Risley pattern. Sweep n is the firing sequences that begin in the n-th period of
/// sweeps, up to a billionth of it early.
class RisleyScan {
 public:
  static constexpr double most_sequences = 1e8;

  /// @throws Error listing every field of `pattern` that is out of bounds, and prisms in which
  /// light
  ///         might be reflected totally.
  explicit RisleyScan(const RisleyPattern& pattern);

  double sweep_rate_hz() const { return sweep_rate_hz_; }
  std::int64_t neighbour_stride() const { return sequence_.cycle_pulses(); }
  std::int64_t pulses(std::int64_t sweep) const noexcept;
  double pulse_time_s(std::int64_t sweep, std::int64_t pulse) const noexcept;
  void fill(std::int64_t sweep, NumberRange pulses, PulseBatch& batch) const noexcept;

 private:
  std::int64_t first_sequence(std::int64_t sweep) const noexcept;

  std::vector<WedgePrism> prisms_;
  double sweep_rate_hz_;
  FiringCycle sequence_;  // the beams as they fall on the first prism
};

/// Returns where light goes after a face, by Snell's law: exact, of unit length.
/// @param direction  unit
/// @param normal     unit, less than 90 degrees from `direction`
/// @param ratio      refractive index before the face over that behind it; the light must not be
///                   reflected totally
glm::dvec3 refracted(const glm::dvec3& direction, const glm::dvec3& normal, double ratio) noexcept;

}  // namespace groundray
