#pragma once

#include <chrono>
#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "apps/scene/simulation.h"
#include "apps/view/recorded/recorded_sensor.h"
#include "apps/view/rendering/layer.h"
#include "apps/view/rendering/view.h"

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

/// Returns a scene's run as a dataset of it would describe it: the frames and trajectories of all
/// sensors. The frames have no files.
RecordedRun run_of(const Simulation& simulation);

/// Returns the layers of a scene's sensors at their first frames: "sensors/NAME" with axes, mount
/// and field of view, and "path/NAME" with the trajectory.
std::vector<Layer> sensor_layers(const Simulation& simulation);

/// Returns the same layers for a dataset, at the start of each sensor's trajectory.
std::vector<Layer> sensor_layers(const RecordedRun& run);

/// Returns the position of a scene's platform in the middle of its run, in D.
glm::dvec3 middle_of_run(const Simulation& simulation);

/// Returns a viewpoint behind and above a target, as for an eye that follows it.
/// @param at_w_m      target.
/// @param ahead       direction of motion; only its horizontal part is used.
/// @param distance_m  approximate distance from the target.
Look look_at(const glm::dvec3& at_w_m, const glm::dvec3& ahead, double distance_m);

/// Returns the recommended viewpoint on a scene's platform at the start of its run, or, if it flies
/// high, on the ground below it.
Look look_at_platform(const Simulation& simulation);

}  // namespace groundray
