#pragma once

#include "apps/scene/world.h"
#include "apps/view/layer.h"

namespace groundray {

/// Gives terrain the column "colour" and colours it by that: what white light from everywhere makes
/// of the ground's materials and images, at the points. Leaves it alone if the ground has no
/// material with colours.
void add_ground_colour(Layer& terrain, const World& world);

/// Returns the colour that is shown for what a surface reflects: linear sRGB becomes sRGB bytes.
glm::u8vec3 shown_colour(const glm::dvec3& reflected);

}  // namespace groundray
