#pragma once

#include <cstddef>
#include <cstdint>

#include "apps/scene/palette.h"
#include "apps/scene/scene_spec.h"
#include "core/appearance/ground_cover.h"
#include "terrain/terrain.h"

namespace groundray {

/// Cover of the ground, with its files loaded.
struct LoadedCover {
  GroundCover cover;              ///< empty if the ground has a single material without an image
  std::uint64_t fingerprint = 0;  ///< equal numbers imply equal images
  std::size_t memory_bytes = 0;   ///< of the images
};

/// Loads the cover of the ground.
/// @throws Error if a file is invalid, and as Palette::index_of.
LoadedCover load_cover(const TerrainSpec& spec, const Terrain& terrain, Palette& palette);

}  // namespace groundray
