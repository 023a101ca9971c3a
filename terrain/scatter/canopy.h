#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <span>

#include "core/appearance/ground_cover.h"
#include "terrain/dem/density_map.h"

namespace groundray {

/// Crown of a plant, seen from above: a disc.
struct Crown {
  glm::dvec2 centre_m{0};  ///< in D
  double radius_m = 0;
};

/// Canopy cover: an image of the share of the disc of `radius_m` around each point that lies below
/// crowns. Crowns that overlap count once.
/// @param area  to be covered, in D; finite.
/// @param cell_m  size of the image's pixels, whose centres are below a crown or not.
/// @param memory_bytes  limit for the computation.
/// @throws Error if it takes more memory.
/// @see docs/reference/ecosystem.md
Drape canopy_cover(std::span<const Crown> crowns, const Area& area, double cell_m, double radius_m,
                   std::size_t memory_bytes);

}  // namespace groundray
