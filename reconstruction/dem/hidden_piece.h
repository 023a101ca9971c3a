#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/dem/fill_shadow.h"
#include "reconstruction/dem/plate_system.h"

// Known ground that is hidden to try how well it is filled, private to this library.
namespace groundray {

/// A hole that is to be filled.
struct TriedHole {
  std::span<const std::uint32_t> samples;  ///< ascending
  double farthest_cells = 0;               ///< from data
  std::optional<GrazingSight> sight;       ///< over it, if it is a shadow
};

/// Returns in how many columns and rows about a sample its roughness counts.
int roughness_reach(double distance_cells) noexcept;

/// A part of a raster, with samples hidden.
struct HiddenPiece {
  glm::ivec2 size{0};
  glm::dvec2 step_m{1};
  std::vector<float> heights_m;       ///< NaN where hidden, or none
  std::vector<std::int32_t> numbers;  ///< as PlateRaster's; all that are to be filled are 0
  std::vector<std::uint32_t> hidden;  ///< samples of this part, ascending
  std::vector<float> truth_m;         ///< of the hidden ones
  std::vector<float> most_m;          ///< bounds of the hidden ones; or empty
};

/// Hides known ground elsewhere: of the shapes of pieces that are cut out of holes, or, for holes
/// that are shadows, what would be in the shadow of sights alike.
class PieceMaker {
 public:
  /// @param raster  numbers: those to be filled are not negative. Must outlive this.
  /// @param holes   not empty. Must outlive this.
  PieceMaker(const PlateRaster& raster, std::span<const TriedHole> holes);

  /// Returns a piece; nothing if there is too little known ground where it was tried. Pieces of
  /// numbers from 0 on are spread evenly over all holes and places.
  std::optional<HiddenPiece> make(std::uint32_t number) const;

 private:
  struct Cut {
    std::vector<glm::ivec2> samples;
    int half_cells = 0;
    const TriedHole* hole = nullptr;
    glm::ivec2 middle{0};
  };
  Cut cut(std::uint32_t number) const;
  glm::ivec2 shift(const Cut& cut, std::uint32_t number) const;
  std::optional<HiddenPiece> make_shadow(const Cut& cut, std::uint32_t number) const;
  bool is_known(glm::ivec2 sample) const noexcept;
  double known_share(const Cut& cut, glm::ivec2 shift) const;
  HiddenPiece hide(const std::vector<glm::ivec2>& samples, double farthest_cells) const;

  const PlateRaster& raster_;
  std::span<const TriedHole> holes_;
  std::vector<std::size_t> ends_;  // of the holes' samples, counted through
};

}  // namespace groundray
