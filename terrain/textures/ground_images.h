#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "core/image/image.h"
#include "terrain/lod/pass.h"

namespace groundray {

/// Kinds of ground that images are made of, in the order of ground_image_names().
enum class GroundImageKind : std::uint8_t {
  BareSoil,
  Mud,
  Gravel,
  Sand,
  ForestLitter,
  Moss,
  ShortGrass,
  DeadGrass,
  Rock,
  Heath
};

/// Returns the names of the kinds as scene files spell them: "bare_soil" and so on.
std::span<const std::string_view> ground_image_names() noexcept;

/// Images of ground seen from above, to be made.
struct GroundImageSpec {
  GroundImageKind kind = GroundImageKind::BareSoil;
  std::uint64_t variant = 0;  ///< each number gives other ground of the same kind
  int pixels = 2048;          ///< columns and rows: a power of two from 64 to 4096
  double size_m = 2;  ///< side of the ground in the images, 0.5 to 8; objects keep their size
  friend bool operator==(const GroundImageSpec&, const GroundImageSpec&) = default;
};

/// Images of a square of ground, its first row in the north. All repeat without seams, and pixels
/// of equal place show the same piece of ground.
struct GroundImages {
  Image8 albedo;  ///< sRGB, with the shade between leaves, blades and stones
  Image8
      normal;  ///< of `height_m`, as a normal map: x east, y north (core/appearance/normal_map.h)
  ImageF height_m;   ///< about a mean of 0
  Image8 roughness;  ///< grey: 0 a mirror, such as water, to 255 matt
};

/// Returns the images of `spec`: the same bytes on every machine and for any runner.
/// @param shown_m  cell size of geometry that already has these heights, or 0: the normal map then
///                 states only what is finer, which is what such cells average out.
/// @throws Error listing every field of `spec` that is out of bounds.
/// @see docs/reference/textures.md for the objects of each kind and their sizes.
GroundImages make_ground_images(const GroundImageSpec& spec, double shown_m = 0,
                                const PassRunner& runner = {});

}  // namespace groundray
