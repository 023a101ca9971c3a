#pragma once

#include "core/tracing/ray_tracer.h"
#include "terrain/lod/clipmap.h"

namespace groundray {

/// Memory up to which a whole surface has quads, bytes: larger ones would take longer to build.
inline constexpr double most_quad_bytes = 512 << 20;

/// Returns the whole surface at full resolution as one level.
/// @param memory_bytes  limit: the level has quads if they take at most this and most_quad_bytes.
Level full_resolution_level(const HeightGrid& grid, double memory_bytes = most_quad_bytes);

/// Returns a tracer for the levels of a clipmap. Level scenes of `previous` with the same content
/// are reused; only the others are built.
/// @param p_DL      origin of the float frame L; see float_frame_origin.
/// @param previous  a tracer built by this function, or null.
RayTracer build_tracer(const Clipmap& clipmap, const glm::dvec3& p_DL, Tracing tracing,
                       const RayTracer* previous = nullptr);

}  // namespace groundray
