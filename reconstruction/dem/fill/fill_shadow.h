#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/dem/thin_plate/thin_plate_system.h"

// Holes in the shadow of the ground before them, private to this library.
namespace groundray {

/// Lines of sight over a hole that lies in the shadow of the ground before it.
struct GrazingSight {
  glm::dvec2 ahead{0};  ///< unit vector in plan of their fall, by columns and rows
  double fall = 0;      ///< slope along `ahead`, above 0
  double above_m = 0;   ///< height above the ground where the hole begins
};

/// Returns the lines of sight that bounds result from. Returns nothing if less than half of the
/// samples have bounds, or if lines pass the ground before the hole at more than half of the height
/// that they lose over it: the hole is then a gap between beams and not the shadow of a crest.
/// Lines are assumed to fall away from the sensor.
/// @param most_m  bound of each sample of the raster; NaN for none.
/// @param hole  samples of the hole, ascending.
std::optional<GrazingSight> sight_over(const PlateRaster& raster, std::span<const float> most_m,
                                       std::span<const std::uint32_t> hole);

/// Known samples, and the heights at which lines of sight would pass above them.
struct CastShadow {
  std::vector<glm::ivec2> samples;
  std::vector<float> most_m;
};

/// Returns the samples of a box of the raster that would be in shadow if similar lines of sight
/// came from another direction: from behind or from the sides, because known ground has no shadows
/// in the original one.
/// @param turn  number of the direction, from 0.
CastShadow cast_shadow(const PlateRaster& raster, const GrazingSight& sight, std::uint32_t turn,
                       glm::ivec2 low, glm::ivec2 high);

}  // namespace groundray
