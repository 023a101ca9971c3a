#pragma once

#include <glm/vec3.hpp>

#include "core/footprint.h"
#include "core/texture.h"

namespace groundray {

/// Returns how much of a surface's colour comes from each of three textures laid on along the x, y
/// and z axes: not negative, sum 1, continuous in the normal. Surfaces within 23 degrees of an axis
/// take that axis alone: then one lookup is enough.
/// @param normal  unit.
glm::dvec3 triplanar_weights(const glm::dvec3& normal) noexcept;

/// Returns the colour of a texture laid on a surface along all three axes, so that it does not
/// smear on steep ground: (u, v) is (y, z), (x, z) and (x, y) of p_m / period_m.
/// @param p_m  position, metres, in the frame of the axes.
/// @param normal  unit. @param patch  what the ray sees of the surface.
/// @param period_m  metres on the ground for each repeat of the texture; positive.
glm::vec3 triplanar_color(const Texture& texture, const glm::dvec3& p_m, const glm::dvec3& normal,
                          const SurfacePatch& patch, double period_m, Filtering filtering) noexcept;

}  // namespace groundray
