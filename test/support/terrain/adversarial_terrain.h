#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/random.h"

namespace groundray::testing {

/// A DEM and its name for messages.
struct NamedTerrain {
  std::string name;
  HeightGrid grid;
};

/// Planes of many sizes, powers of two and others, down to 2 x 2 samples, whose heights are exact
/// in float.
std::vector<NamedTerrain> planes();

/// Independent random heights between 0 and `relief_m`: no two facets are coplanar.
HeightGrid white_noise(glm::ivec2 samples, double relief_m, Seed seed);

/// Terrain that breaks meshers: spikes, pits and steps next to every power of two, a checkerboard,
/// noise, noise of one ulp at large heights, planes, strips of one cell, odd sizes, a fractal,
/// holes of one and of many samples, islands. Most are up to some 100 samples wide.
std::vector<NamedTerrain> adversarial_terrain();

}  // namespace groundray::testing
