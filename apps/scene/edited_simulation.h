#pragma once

#include "apps/scene/simulation.h"

namespace groundray {

/// Builds the simulation of a scene that differs from another's in its seed, weather, sky, mounts
/// and densities of scattered layers alone. It shares the terrain of `base`, which is not read
/// again, and its objects unless the seed or a density changes where these are scattered.
/// @throws Error as build_simulation.
Simulation edited_simulation(SceneSpec spec, const Simulation& base);

}  // namespace groundray
