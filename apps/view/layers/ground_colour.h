#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <utility>

#include "apps/scene/simulation.h"
#include "apps/view/rendering/layer.h"
#include "core/appearance/ground_cover.h"
#include "core/appearance/materials.h"

namespace groundray {

/// Colour of a scene's ground under uniform white illumination. Any number of threads may use one;
/// the scene must outlive it.
class GroundColour {
 public:
  /// Returns std::nullopt if the ground has no material, or its spectra do not cover the visible
  /// range.
  static std::optional<GroundColour> of(const Simulation& simulation);

  /// Returns the displayed sRGB colour of a patch of width `patch_m`.
  glm::u8vec3 shown_at(const GroundCover::Point& point, double patch_m) const;
  /// Returns true if the colour varies over the ground.
  bool varies() const noexcept { return !cover_->empty(); }

 private:
  GroundColour(const GroundCover& cover, Materials::InColour colours)
      : cover_(&cover), colours_(std::move(colours)) {}
  glm::dvec3 reflected_at(const GroundCover::Point& point, double patch_m) const;

  const GroundCover* cover_;
  Materials::InColour colours_;
};

/// Adds the column "colour" to the terrain's points and selects it: the colour of the ground's
/// materials and images under uniform white illumination. Does nothing if the ground has no
/// material with colours.
void add_ground_colour(Layer& terrain, const Simulation& simulation);

/// Adds a ground texture to a terrain that has the column "colour", if the ground has images. The
/// texture consists of nested squares round an eye that double in width and have equal numbers of
/// texels, so it is sharpest near the eye. Each triangle is textured from the smallest square that
/// contains it. Points between triangles of different squares are duplicated with all their values.
/// The terrain's `coarse` gets the same texture.
/// @param eye_m  eye, in D.
void drape_ground(Layer& terrain, const Simulation& simulation, const glm::dvec3& eye_m);

/// Returns the colours of a scene's materials; std::nullopt if there are none, or their spectra do
/// not cover the visible range.
std::optional<Materials::InColour> material_colours(const Simulation& simulation);

/// Returns the displayed sRGB bytes of a linear sRGB reflectance, after a fixed exposure.
glm::u8vec3 shown_colour(const glm::dvec3& reflected);

}  // namespace groundray
