#pragma once

#include <glm/vec3.hpp>

#include "core/tangents.h"

namespace groundray {

/// Where the green of a normal map points: along increasing v (OpenGL, glTF) or against it
/// (DirectX).
enum class NormalMapGreen { AlongV, AgainstV };

/// A shading normal makes at least this cosine with the geometric one.
inline constexpr double least_shading_cosine = 1e-3;

/// Returns the normal that a texel of a normal map stands for: 2 c - 1 of each value, as glTF has
/// it, so that 0.5 is flat; x along u, y along v, z off the surface. Not unit: the mean of texels
/// stands for the mean of their normals. Half a step of 8 bits is a tilt of 0.22 degrees.
/// @param texel  linear values from 0 to 1.
glm::dvec3 decode_normal(glm::vec3 texel, NormalMapGreen green) noexcept;

/// Returns the normal to shade with, unit: `bump` in the frame of x along dp_du as far as it is
/// across `base`, y across both on the side of dp_dv (as MikkTSpace has it), z = `base`. Where that
/// is below the horizon of `geometric` it is lifted onto it: dot(result, geometric) >=
/// least_shading_cosine. Without tangents or a bump it is `base`, lifted likewise. Only shading
/// knows of it: ranges and positions do not.
/// @param base  interpolated from the vertices, or the geometric normal; unit, on the ray's side.
/// @param geometric  of the facet, unit, on the ray's side.
/// @param bump  of decode_normal; its length does not matter. Below z = 0 it counts as z = 0.
/// @see Mikkelsen, Simulation of wrinkled surfaces revisited (2008).
glm::dvec3 shading_normal(const Tangents& tangents, const glm::dvec3& base,
                          const glm::dvec3& geometric, const glm::dvec3& bump) noexcept;

}  // namespace groundray
