#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <span>

#include "apps/view/layer.h"
#include "core/ray_tracer.h"

namespace groundray {

/// Returns how many triangles the leaves of levels have, about: those that holes and thinned sides
/// leave out count.
std::size_t count_triangles(std::span<const Level> levels);

/// Returns the layer "terrain" of a clipmap: its triangles as they are traced (docs/terrain.md),
/// each of the leaves' shapes with the sides that are thinned for coarser neighbours.
///
/// Columns of points: "height"; of cells: "slope", "clipmap level" (the window that a triangle lies
/// in), "cell size" (of its leaf, by power of two) and "certified deviation" (of its leaf from the
/// reference surface, vertically).
/// @param levels  finest first.
/// @param origin_w_m  of D. @param near_m  where in D the layer's floats are to be good.
Layer terrain_layer(std::span<const Level> levels, const glm::dvec3& origin_w_m,
                    const glm::dvec3& near_m);

}  // namespace groundray
