#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "apps/python/points.h"
#include "apps/python/scene_state.h"
#include "sensors/lidar.h"

namespace groundray::python {

/// One sweep of a scene's lidar: the echoes, and what comes with them.
struct Sweep : Points {
  Points no_returns;
  Waveforms waveforms;
  Convergence convergence;
  std::int64_t frame = 0;
  std::shared_ptr<const SceneState> state;
  std::size_t lidar = 0;  ///< among the scene's

  const PlacedLidar& placed() const { return state->world.lidars[lidar]; }
  std::chrono::nanoseconds stamp() const { return placed().lidar.pattern().stamp(frame); }
};

}  // namespace groundray::python
