#pragma once

#include <string>
#include <vector>

#include "apps/scene/simulation.h"

namespace groundray {

/// Returns a sentence for each setting of a scene that has no effect or is unusual enough to be a
/// mistake: weather that a lidar ignores, fog under a clear sky, a lens that folds inside its
/// image, noise beyond any data sheet, a tolerance above a sensor's height, sampling without a
/// limit. Equal scenes have equal notes.
std::vector<std::string> notes_of(const Simulation& simulation);

}  // namespace groundray
