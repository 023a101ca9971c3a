#pragma once

// Private to the library: the ground's cover.
#include <cstddef>
#include <cstdint>

#include "apps/scene/ground_spec.h"
#include "apps/scene/model_library.h"
#include "apps/scene/sites.h"
#include "core/appearance/ground_cover.h"
#include "terrain/terrain.h"

namespace groundray {

/// Cover of the ground, with its files loaded.
struct LoadedCover {
  GroundCover cover;              ///< empty if the ground has a single material without an image
  std::uint64_t fingerprint = 0;  ///< equal numbers imply equal images
  std::size_t memory_bytes = 0;   ///< of the images
};

/// Loads and computes what decides on the ground's materials.
/// @throws Error that names the layer or file.
LoadedCover load_cover(const TerrainSpec& spec, const Terrain& terrain, Sites& sites,
                       Palette& palette);

}  // namespace groundray
