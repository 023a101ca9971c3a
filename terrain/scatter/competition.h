#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace groundray {

/// Plant that competes with its neighbours for room.
struct Contender {
  glm::dvec2 p_m{0};  ///< in plan
  double height_m = 0;
  double zone_m = 0;     ///< radius of its zone of influence
  double tolerance = 0;  ///< share of the zones' distance that it yields to taller plants, 0 to 1
  double min_distance_m = 0;  ///< to any other plant
  std::uint32_t species = 0;  ///< equal heights: the lower species, then the lower key, is taller
  std::uint64_t key = 0;
};

/// Returns the indices of the plants that survive, in ascending order. A plant survives unless it
/// is, from a taller plant that survives, nearer than the minimum distance of either, or nearer
/// than the sum of their zones' radii times 1 - tolerance. Therefore only taller neighbours decide,
/// and the survivors do not depend on the order of the plants.
/// @see docs/reference/ecosystem.md
std::vector<std::size_t> survivors(std::span<const Contender> plants);

}  // namespace groundray
