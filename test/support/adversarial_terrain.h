#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "core/height_grid.h"
#include "core/random.h"

namespace groundray::testing {

/// A DEM and what to call it in a message.
struct NamedTerrain {
  std::string name;
  HeightGrid grid;
};

/// Planes of many sizes, powers of two and others, down to 2 x 2 samples, whose heights are exact
/// in float.
std::vector<NamedTerrain> planes();

/// Independent heights between 0 and `relief_m`: no two facets lie in one plane.
HeightGrid white_noise(glm::ivec2 samples, double relief_m, Seed seed);

/// What breaks meshers: spikes, pits and steps beside every power of two, a checkerboard, noise,
/// noise of one ulp far from zero, planes, strips of one cell, odd sizes, a fractal, holes of one
/// sample and of many, islands. Most are up to some 100 samples across.
std::vector<NamedTerrain> adversarial_terrain();

}  // namespace groundray::testing
