#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/dem/thin_plate/thin_plate_system.h"

// Known ground that is hidden to test fills, private to this library.
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
std::optional<GrazingSight> sight_over(const ThinPlateRaster& raster, std::span<const float> most_m,
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
CastShadow cast_shadow(const ThinPlateRaster& raster, const GrazingSight& sight, std::uint32_t turn,
                       glm::ivec2 low, glm::ivec2 high);

/// Hole to be filled.
struct TriedHole {
  std::span<const std::uint32_t> samples;  ///< ascending
  double farthest_cells = 0;               ///< largest distance from data
  std::optional<GrazingSight> sight;       ///< lines of sight over it, if it is a shadow
};

/// Part of a raster with hidden samples.
struct HoldoutMask {
  glm::ivec2 size{0};
  glm::dvec2 step_m{1};
  std::vector<float> heights_m;       ///< NaN where hidden or missing
  std::vector<std::int32_t> numbers;  ///< as in ThinPlateRaster; 0 for all samples to fill
  std::vector<std::uint32_t> hidden;  ///< samples of this part, ascending
  std::vector<float> truth_m;         ///< heights of the hidden samples
  std::vector<float> most_m;          ///< bounds of the hidden samples; or empty

  ThinPlateRaster raster() const noexcept { return {size, step_m, heights_m, numbers}; }
};

/// Source of pieces of known ground to hide: in the shape of pieces cut out of holes, or, for
/// shadows, the samples that similar lines of sight would leave in shadow.
class HoldoutMaskMaker {
 public:
  /// @param raster  samples to fill have numbers >= 0. Must outlive this.
  /// @param holes  not empty. Must outlive this.
  HoldoutMaskMaker(const ThinPlateRaster& raster, std::span<const TriedHole> holes);

  /// Returns piece `number`; nothing if there is too little known ground at the positions tried.
  /// Numbers from 0 on are spread evenly over all holes and positions.
  std::optional<HoldoutMask> make(std::uint32_t number) const;

 private:
  struct Cut {
    std::vector<glm::ivec2> samples;
    int half_cells = 0;
    const TriedHole* hole = nullptr;
    glm::ivec2 middle{0};
  };
  Cut cut(std::uint32_t number) const;
  glm::ivec2 shift(const Cut& cut, std::uint32_t number) const;
  std::optional<HoldoutMask> make_shadow(const Cut& cut, std::uint32_t number) const;
  double known_share(const Cut& cut, glm::ivec2 shift) const;
  HoldoutMask hide(const std::vector<glm::ivec2>& samples, double farthest_cells) const;

  const ThinPlateRaster& raster_;
  std::span<const TriedHole> holes_;
  std::vector<std::size_t> ends_;  // cumulative numbers of the holes' samples
};

}  // namespace groundray
