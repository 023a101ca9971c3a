#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <span>

#include "apps/view/rendering/layer.h"
#include "core/tracing/ray_tracer.h"

namespace groundray {

/// Returns the approximate number of triangles in the leaves of levels. It includes triangles that
/// holes and thinned sides remove.
std::size_t count_triangles(std::span<const Level> levels);

/// Returns the layer "terrain" of a clipmap: its triangles as they are traced
/// (docs/theory/terrain.md), with the sides of leaves thinned towards coarser neighbours.
///
/// Point column: "height". Cell columns: "slope", "clipmap level" (the window that contains the
/// triangle), "cell size" (of its leaf, as a power of two) and "certified deviation" (largest
/// vertical distance of its leaf from the reference surface).
/// @param levels      finest first.
/// @param origin_w_m  origin of D, in W.
/// @param near_m      point in D near which the layer's floats are most precise.
Layer terrain_layer(std::span<const Level> levels, const glm::dvec3& origin_w_m,
                    const glm::dvec3& near_m);

}  // namespace groundray
