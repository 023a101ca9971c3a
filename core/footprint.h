#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "core/tangents.h"

namespace groundray {

/// What a ray with a width sees of a texture: the parallelogram of points uv + s a_uv + t b_uv with
/// s and t from -1/2 to 1/2.
struct Footprint {
  glm::dvec2 a_uv{0};
  glm::dvec2 b_uv{0};
};

/// The same on a surface, in metres; both vectors lie in its tangent plane.
struct SurfacePatch {
  glm::dvec3 a_m{0};
  glm::dvec3 b_m{0};
};

/// Grazing rays count as if they met the surface at this cosine: patches stay finite.
inline constexpr double least_patch_cosine = 1e-3;

/// Returns the patch of a surface that a square of side `width_m` across the ray is projected to
/// along the ray. One side of the square lies in the surface.
/// @param width_m  of the ray where it meets the surface: its range times the angle of a pixel. For
///        beams that are not square, the side of the square with the same variance: that of a
///        uniform disc is sqrt(3)/2 of its diameter, that of a Gaussian sqrt(3) times its 1/e^2
///        radius.
/// @param direction  of the ray, unit.
/// @param normal  of the surface, unit, on either side.
/// @see Akenine-Moeller et al., Improved shader and texture level of detail using ray cones, JCGT
///      10(1) (2021), section 5; Igehy, Tracing ray differentials (1999).
SurfacePatch surface_patch(double width_m, const glm::dvec3& direction,
                           const glm::dvec3& normal) noexcept;

/// Returns what a patch of a surface covers of a texture: zero where the tangents are parallel.
Footprint footprint_of(const SurfacePatch& patch, const Tangents& tangents) noexcept;

}  // namespace groundray
