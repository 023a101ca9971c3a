#pragma once

#include <glm/vec3.hpp>

#include "core/appearance/footprint.h"
#include "core/appearance/texture.h"

namespace groundray {

/// Returns the weights of three textures that are projected along the x, y and z axes: not
/// negative, with sum 1, continuous in the normal. On surfaces within 23 degrees of an axis only
/// that axis has a weight, and one lookup suffices.
/// @param normal  unit.
glm::dvec3 triplanar_weights(const glm::dvec3& normal) noexcept;

/// Returns the colour of a texture that is projected onto a surface along all three axes, so that
/// it is not stretched on steep ground: (u, v) is (y, z), (x, z) and (x, y) of p_m / period_m.
/// @param p_m  position, metres, in the frame of the axes.
/// @param normal  unit.
/// @param patch  patch of the surface that the ray covers.
/// @param period_m  metres on the ground for each repeat of the texture; positive.
glm::vec3 triplanar_color(const Texture& texture, const glm::dvec3& p_m, const glm::dvec3& normal,
                          const SurfacePatch& patch, double period_m, Filtering filtering) noexcept;

}  // namespace groundray
