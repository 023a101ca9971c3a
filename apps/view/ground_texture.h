#pragma once

#include <glm/vec3.hpp>

#include "apps/scene/world.h"
#include "apps/view/layer.h"

namespace groundray {

/// Gives terrain that has the column "colour" the texture of its ground, if that has images: sharp
/// near an eye, and less so farther out, by squares round the eye that double in width, all of as
/// many texels. Each triangle takes its colours from the smallest square that holds it; corners of
/// triangles that take theirs from other ones become points of their own, with the same numbers.
/// The terrain's `coarse` gets the same texture.
/// @param eye_m  in D.
void drape_ground(Layer& terrain, const World& world, const glm::dvec3& eye_m);

}  // namespace groundray
