#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <utility>

#include "apps/scene/world.h"
#include "apps/view/layer.h"
#include "core/ground_cover.h"
#include "core/materials.h"

namespace groundray {

/// What white light from everywhere makes of a scene's ground. Any number of threads may ask; the
/// scene is to outlive it.
class GroundColour {
 public:
  /// Returns none for ground that has no material with colours.
  static std::optional<GroundColour> of(const World& world);

  /// Returns the colour that is shown of a patch so wide, sRGB.
  glm::u8vec3 shown_at(const GroundCover::Point& point, double patch_m) const;
  /// Whether it differs from place to place.
  bool varies() const noexcept { return !cover_->empty(); }

 private:
  GroundColour(const GroundCover& cover, Materials::InColour colours)
      : cover_(&cover), colours_(std::move(colours)) {}
  glm::dvec3 reflected_at(const GroundCover::Point& point, double patch_m) const;

  const GroundCover* cover_;
  Materials::InColour colours_;
};

/// Gives terrain the column "colour" and colours it by that: what white light from everywhere makes
/// of the ground's materials and images, at the points. Leaves it alone if the ground has no
/// material with colours.
void add_ground_colour(Layer& terrain, const World& world);

/// Returns the colour that is shown for what a surface reflects: linear sRGB becomes sRGB bytes.
glm::u8vec3 shown_colour(const glm::dvec3& reflected);

}  // namespace groundray
