#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "apps/python/binding/points.h"
#include "apps/python/scene_state.h"
#include "sensors/lidar/lidar.h"

namespace groundray::python {

/// Sweep of a scene's lidar: its echoes and the data that belong to them.
struct Sweep : Points {
  Points no_returns;
  Waveforms waveforms;
  Convergence convergence;
  std::int64_t frame = 0;
  std::shared_ptr<const SceneState> state;
  std::size_t lidar = 0;  ///< index in the scene

  const PlacedLidar& placed() const { return state->simulation.lidars[lidar]; }
  std::chrono::nanoseconds stamp() const { return placed().lidar.pattern().stamp(frame); }
};

}  // namespace groundray::python
