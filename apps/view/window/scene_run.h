#pragma once

#include "apps/scene/simulation.h"
#include "apps/view/recorded/recorded_sensor.h"

namespace groundray {

/// Returns a scene's run as a dataset of it would describe it: the frames and trajectories of all
/// sensors. The frames have no files.
RecordedRun run_of(const Simulation& simulation);

}  // namespace groundray
