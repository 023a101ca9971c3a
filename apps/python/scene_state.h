#pragma once

#include <cstddef>
#include <memory>
#include <utility>

#include "apps/python/frame_scene_cache.h"
#include "apps/scene/simulation.h"

namespace groundray::python {

/// Loaded scene and the scenes that its frames see. All Python objects of a scene share it.
struct SceneState {
  explicit SceneState(Simulation loaded) : simulation(std::move(loaded)), frames(simulation) {}

  Simulation simulation;
  FrameSceneCache frames;
};

/// Lidar of a scene.
struct SceneLidar {
  std::shared_ptr<SceneState> state;
  std::size_t index = 0;

  const PlacedLidar& placed() const { return state->simulation.lidars[index]; }
};

/// Camera of a scene.
struct SceneCamera {
  std::shared_ptr<SceneState> state;
  std::size_t index = 0;

  const PlacedCamera& placed() const { return state->simulation.cameras[index]; }
};

}  // namespace groundray::python
