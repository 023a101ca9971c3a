#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/dem/plate_system.h"

// Holes that lie in the shadow of the ground before them, private to this library.
namespace groundray {

/// How lines of sight pass over a hole that is in the shadow of the ground before it.
struct GrazingSight {
  glm::dvec2 ahead{
      0};           ///< of length 1, in plan, columns and rows counting positive: where they fall
  double fall = 0;  ///< along it, above 0
  double above_m = 0;  ///< how far above the ground they pass where the hole begins
};

/// Returns how the lines pass that bounds come from; nothing if less than half of the samples are
/// bounded, or if lines pass the ground before the hole at more than half of the height that they
/// lose over it: then it is no crest that hides the hole, but a gap between beams. Lines are taken
/// to fall away from the sensor.
/// @param most_m  of each sample of the raster; NaN for none.
/// @param hole    samples of it, ascending.
std::optional<GrazingSight> sight_over(const PlateRaster& raster, std::span<const float> most_m,
                                       std::span<const std::uint32_t> hole);

/// Known samples, and the heights that lines of sight would pass above them.
struct CastShadow {
  std::vector<glm::ivec2> samples;
  std::vector<float> most_m;
};

/// Returns what of a box of the raster would be in shadow if lines fell like those from elsewhere:
/// backwards or to the sides, since known ground has no shadows ahead.
/// @param turn  0, 1, ...: in which of these directions.
CastShadow cast_shadow(const PlateRaster& raster, const GrazingSight& sight, std::uint32_t turn,
                       glm::ivec2 low, glm::ivec2 high);

}  // namespace groundray
