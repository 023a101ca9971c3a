#pragma once

#include <cstddef>
#include <cstdint>

#include "apps/scene/palette.h"
#include "core/ground_cover.h"
#include "sensors/scene_spec.h"
#include "terrain/terrain.h"

namespace groundray {

/// What the ground is made of, loaded.
struct LoadedCover {
  GroundCover cover;              ///< empty if that is one material without an image
  std::uint64_t fingerprint = 0;  ///< equal numbers mean equal images
  std::size_t memory_bytes = 0;   ///< of the images
};

/// @throws Error if a file is at fault, or a laser's wavelength is not in a material's spectrum.
LoadedCover load_cover(const TerrainSpec& spec, const Terrain& terrain, Palette& palette);

}  // namespace groundray
