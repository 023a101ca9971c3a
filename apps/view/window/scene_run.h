#pragma once

#include "apps/scene/world.h"
#include "apps/view/recorded_sensor.h"

namespace groundray {

/// Returns a scene's run as a dataset of it would tell it: when which sensor makes which frame, and
/// where it is meanwhile. Its frames have no files.
RecordedRun run_of(const World& world);

}  // namespace groundray
