#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
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

}  // namespace groundray
