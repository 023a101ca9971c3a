#pragma once

#include <glm/vec3.hpp>

#include "apps/scene/simulation.h"
#include "apps/view/rendering/layer.h"

namespace groundray {

/// Adds a ground texture to a terrain that has the column "colour", if the ground has images. The
/// texture consists of nested squares round an eye that double in width and have equal numbers of
/// texels, so it is sharpest near the eye. Each triangle is textured from the smallest square that
/// contains it. Points between triangles of different squares are duplicated with all their values.
/// The terrain's `coarse` gets the same texture.
/// @param eye_m  eye, in D.
void drape_ground(Layer& terrain, const Simulation& simulation, const glm::dvec3& eye_m);

}  // namespace groundray
