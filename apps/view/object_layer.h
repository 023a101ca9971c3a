#pragma once

#include <chrono>
#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "apps/scene/world.h"
#include "apps/view/layer.h"

namespace groundray {

/// Returns the layers of what stands and moves in a scene at a time, one for each entry of the
/// scene file: "objects/NAME" of what has a colour of its own by its materials, with the columns
/// "label" and "instance" of cells.
/// @param near_m  in D: of more triangles than `most_triangles` in all, those of the objects
/// nearest
///        to it, in plan, are shown.
std::vector<Layer> object_layers(const World& world, std::chrono::nanoseconds time,
                                 const glm::dvec3& near_m, std::size_t most_triangles);

/// Returns the layer of one entry, as object_layers.
/// @param group  among world.content.groups.
Layer object_layer(const World& world, std::size_t group, std::chrono::nanoseconds time,
                   const glm::dvec3& near_m, std::size_t most_triangles);

}  // namespace groundray
