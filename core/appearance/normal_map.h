#pragma once

#include <glm/vec3.hpp>

#include "core/geometry/tangents.h"

namespace groundray {

/// Least cosine between a shading normal and the geometric normal.
inline constexpr double least_shading_cosine = 1e-3;

/// Returns the normal that a texel of a normal map encodes: 2 c - 1 of each value, as in glTF, so
/// that 0.5 is flat; x along u, y along v (OpenGL's convention), z away from the surface. The
/// result is not normalised: the mean of texels gives the mean of their normals. Half a step of 8
/// bits is a tilt of 0.22 degrees.
/// @param texel  linear values from 0 to 1.
glm::dvec3 decode_normal(glm::vec3 texel) noexcept;

/// Returns the shading normal, unit: `bump` in the tangent frame of MikkTSpace, with x along the
/// part of dp_du perpendicular to `base`, y perpendicular to both on the side of dp_dv, and z =
/// `base`. A result below the horizon of `geometric` is lifted to it: dot(result, geometric) >=
/// least_shading_cosine. Without tangents or a bump it is `base`, lifted likewise. Ranges and
/// positions do not depend on it.
/// @param base  interpolated from the vertices, or the geometric normal; unit, on the ray's side.
/// @param geometric  of the facet, unit, on the ray's side.
/// @param bump  of decode_normal; its length is ignored. z < 0 counts as z = 0.
/// @see Mikkelsen, Simulation of wrinkled surfaces revisited (2008).
glm::dvec3 shading_normal(const Tangents& tangents, const glm::dvec3& base,
                          const glm::dvec3& geometric, const glm::dvec3& bump) noexcept;

}  // namespace groundray
