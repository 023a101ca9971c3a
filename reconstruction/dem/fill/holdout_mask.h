#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/dem/fill/fill_shadow.h"
#include "reconstruction/dem/thin_plate/thin_plate_system.h"

// Known ground that is hidden to test fills, private to this library.
namespace groundray {

/// Hole to be filled.
struct TriedHole {
  std::span<const std::uint32_t> samples;  ///< ascending
  double farthest_cells = 0;               ///< largest distance from data
  std::optional<GrazingSight> sight;       ///< lines of sight over it, if it is a shadow
};

/// Returns the number of columns and rows around a sample, at a distance from data, over which its
/// roughness is averaged.
int roughness_reach(double distance_cells) noexcept;

/// Part of a raster with hidden samples.
struct HoldoutMask {
  glm::ivec2 size{0};
  glm::dvec2 step_m{1};
  std::vector<float> heights_m;       ///< NaN where hidden or missing
  std::vector<std::int32_t> numbers;  ///< as in PlateRaster; 0 for all samples to fill
  std::vector<std::uint32_t> hidden;  ///< samples of this part, ascending
  std::vector<float> truth_m;         ///< heights of the hidden samples
  std::vector<float> most_m;          ///< bounds of the hidden samples; or empty
};

/// Source of pieces of known ground to hide: in the shape of pieces cut out of holes, or, for
/// shadows, the samples that similar lines of sight would leave in shadow.
class HoldoutMaskMaker {
 public:
  /// @param raster  samples to fill have numbers >= 0. Must outlive this.
  /// @param holes  not empty. Must outlive this.
  HoldoutMaskMaker(const PlateRaster& raster, std::span<const TriedHole> holes);

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
  bool is_known(glm::ivec2 sample) const noexcept;
  double known_share(const Cut& cut, glm::ivec2 shift) const;
  HoldoutMask hide(const std::vector<glm::ivec2>& samples, double farthest_cells) const;

  const PlateRaster& raster_;
  std::span<const TriedHole> holes_;
  std::vector<std::size_t> ends_;  // cumulative numbers of the holes' samples
};

}  // namespace groundray
