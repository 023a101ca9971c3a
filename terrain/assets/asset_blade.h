#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"

namespace groundray {

/// Blade of grass: it tapers, leans outward, bends increasingly towards its tip and twists.
struct Blade {
  glm::dvec3 foot{0};
  double azimuth = 0;  ///< rad, towards which it leans
  double length = 0, width = 0;
  double lean = 0;   ///< angle of the foot from the vertical, rad
  double bend = 0;   ///< further angle of the tip, rad
  double twist = 0;  ///< of the tip about the blade's axis, rad
};

/// Adds a blade as a sheet of five triangles.
/// @return the position of its tip.
glm::dvec3 add_blade(AssetBuilder& builder, const Blade& blade, std::uint16_t surface);

/// Adds a narrow lens-shaped sheet, folded along its middle, from `from` to `to`: a spikelet or a
/// leaflet. Its sides extend along `side`, which is perpendicular to it and half its width long.
void add_leaflet(AssetBuilder& builder, const glm::dvec3& from, const glm::dvec3& to,
                 const glm::dvec3& side, std::uint16_t surface);

/// Scales a plant to a height above the ground.
void scale_to_height(AssetBuilder& builder, double height_m);

}  // namespace groundray
