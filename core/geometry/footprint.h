#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "core/geometry/tangents.h"

namespace groundray {

/// Footprint of a ray on a texture: the parallelogram of points uv + s a_uv + t b_uv with s and t
/// from -1/2 to 1/2.
struct Footprint {
  glm::dvec2 a_uv{0};
  glm::dvec2 b_uv{0};
};

/// The same parallelogram on the surface, metres; both sides lie in its tangent plane.
struct SurfacePatch {
  glm::dvec3 a_m{0};
  glm::dvec3 b_m{0};
};

/// Lower bound of the cosine of incidence in surface_patch: patches of grazing rays stay finite.
inline constexpr double least_patch_cosine = 1e-3;

/// Returns the projection, along the ray, of a square of side `width_m` across the ray onto a
/// surface. One side of the square is parallel to the surface.
/// @param width_m  width of the ray where it hits the surface: its range times the angle of a
///                 pixel. For other beam profiles, the side of the square with the same variance:
///                 sqrt(3)/2 of the diameter of a uniform disc, or sqrt(3) times the 1/e^2 radius
///                 of a Gaussian.
/// @param direction  of the ray, unit.
/// @param normal  of the surface, unit, on either side.
/// @see Akenine-Moeller et al., Improved shader and texture level of detail using ray cones, JCGT
///      10(1) (2021), section 5; Igehy, Tracing ray differentials (1999).
SurfacePatch surface_patch(double width_m, const glm::dvec3& direction,
                           const glm::dvec3& normal) noexcept;

/// Returns the footprint of a surface patch on a texture; zero if the tangents are parallel.
Footprint footprint_of(const SurfacePatch& patch, const Tangents& tangents) noexcept;

}  // namespace groundray
