#pragma once

#include <cstddef>
#include <memory>
#include <utility>

#include "apps/python/frame_scenes.h"
#include "apps/scene/world.h"

namespace groundray::python {

/// A scene that is loaded, and what its frames see. All that Python has of it shares it.
struct SceneState {
  explicit SceneState(World loaded) : world(std::move(loaded)), frames(world) {}

  World world;
  FrameScenes frames;
};

/// A lidar of a scene.
struct SceneLidar {
  std::shared_ptr<SceneState> state;
  std::size_t index = 0;

  const PlacedLidar& placed() const { return state->world.lidars[index]; }
};

/// A camera of a scene.
struct SceneCamera {
  std::shared_ptr<SceneState> state;
  std::size_t index = 0;

  const PlacedCamera& placed() const { return state->world.cameras[index]; }
};

}  // namespace groundray::python
