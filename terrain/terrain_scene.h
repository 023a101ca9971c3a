#pragma once

#include "core/tracing/ray_tracer.h"
#include "terrain/lod/clipmap.h"

namespace groundray {

/// Returns the whole surface at full resolution as one level.
Level full_resolution_level(const HeightGrid& grid);

/// Returns a tracer for the levels of a clipmap. Level scenes of `previous` with the same content
/// are reused; only the others are built.
/// @param p_DL      origin of the float frame L; see float_frame_origin.
/// @param previous  a tracer built by this function, or null.
RayTracer build_tracer(const Clipmap& clipmap, const glm::dvec3& p_DL, Tracing tracing,
                       const RayTracer* previous = nullptr);

}  // namespace groundray
