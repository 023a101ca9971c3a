#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "sensors/lidar/pattern/firing_cycle.h"
#include "sensors/lidar/pattern/spinning_pattern.h"

namespace groundray {

/// Glass wedge that rotates about S's x axis. One face is perpendicular to x, the other is tilted
/// by the wedge angle. The base is the side where the glass is thickest; light bends towards it.
struct WedgePrism {
  enum class Tilted { Exit, Entry };  ///< tilted face: the last or the first that light passes
  double wedge_rad = 0;
  double refractive_index = 1.5;  ///< relative to the air
  double rate_hz = 0;   ///< turns per second, from y to z: counter-clockwise seen against the light
  double base_rad = 0;  ///< direction of the base at time 0, from y towards z
  Tilted tilted = Tilted::Exit;
};

/// Beams that pass up to three rotating prisms (Risley prisms). Before the first prism, each beam
/// is parallel to x except for its own angles. Incommensurable rates draw a rosette that never
/// repeats. All beams leave from S's origin: their displacement by centimetres in the prisms is not
/// modelled.
/// @see Li, Liu and Sun, Forward and inverse solutions for three-element Risley prism beam scanners
///      (2017), doi:10.1364/OE.25.007677
struct RisleyPattern {
  std::vector<WedgePrism> prisms;
  /// Beams before the first prism; firing times and rings as for a spinning head. Loops and origins
  /// must be 0.
  std::vector<Beam> beams;
  double firing_period_s = 0;  ///< from one firing sequence to the next
  double sweep_rate_hz = 10;
};

/// Pulses of a Risley pattern. Sweep n consists of the firing sequences that begin in the n-th
/// period of `sweep_rate_hz`, or up to 1e-9 of a period before it.
class RisleyScan {
 public:
  static constexpr double most_sequences = 1e8;

  /// @throws Error listing every field of `pattern` that is out of bounds, and prisms in which
  ///         light might undergo total internal reflection.
  explicit RisleyScan(const RisleyPattern& pattern);

  const FiringCycle& cycle() const { return sequence_; }
  double sweep_rate_hz() const { return sweep_rate_hz_; }
  std::int64_t neighbour_stride() const { return sequence_.cycle_pulses(); }
  SweepPulses runs(std::int64_t sweep) const noexcept;
  /// Replaces the directions of pulses before the prisms by those behind them.
  void refract(PulseBatch& batch) const noexcept;

 private:
  std::vector<WedgePrism> prisms_;
  double sweep_rate_hz_;
  FiringCycle sequence_;  // the beams before the first prism
};

/// Returns the direction of light behind a face by Snell's law: exact, of unit length.
/// @param direction  unit vector.
/// @param normal  unit vector, less than 90 degrees from `direction`.
/// @param ratio  refractive index before the face over that behind it; there must be no total
///        internal reflection.
glm::dvec3 refracted(const glm::dvec3& direction, const glm::dvec3& normal, double ratio) noexcept;

}  // namespace groundray
