#pragma once

#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "apps/scene/world.h"
#include "apps/view/layer.h"
#include "apps/view/recorded_sensor.h"
#include "apps/view/view.h"

namespace groundray {

/// Returns the layers of a scene's sensors at its first frame: "sensors/NAME", axes, mount and what
/// each sees, and "path/NAME", where it goes.
std::vector<Layer> sensor_layers(const World& world);

/// Returns those of a dataset at its first frames.
std::vector<Layer> sensor_layers(const RecordedRun& run);

/// Returns where the platform of a scene is in the middle of its run, in D.
glm::dvec3 middle_of_run(const World& world);

/// Returns a look at a place from behind and above, as a following eye has it.
/// @param at_w_m  looked at. @param distance_m  from there.
Look look_at(const glm::dvec3& at_w_m, const glm::dvec3& ahead, double distance_m);

/// Returns how a scene's platform is best seen at the begin of its run.
Look look_at_platform(const World& world);

}  // namespace groundray
