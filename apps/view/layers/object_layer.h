#pragma once

#include <chrono>
#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "apps/scene/simulation.h"
#include "apps/view/rendering/layer.h"

namespace groundray {

/// Returns the layers of a scene's objects at a time, one for each entry of the scene file, with
/// the name "objects/NAME". They are coloured by their materials, or by label without materials,
/// and have the cell columns "label" and "instance".
/// @param near_m  in D: if the objects have more than `most_triangles` triangles, only those
///                nearest to this point (horizontally) are shown.
std::vector<Layer> object_layers(const Simulation& simulation, std::chrono::nanoseconds time,
                                 const glm::dvec3& near_m, std::size_t most_triangles);

/// Returns the layer of one entry, as object_layers().
/// @param group  index into simulation.scene_objects.groups.
Layer object_layer(const Simulation& simulation, std::size_t group, std::chrono::nanoseconds time,
                   const glm::dvec3& near_m, std::size_t most_triangles);

}  // namespace groundray
