#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "core/scene.h"
#include "sensors/scene_spec.h"
#include "terrain/terrain.h"

namespace groundray {

/// What stands and moves in a scene, and what the ground is made of, built for tracing.
struct Content {
  /// Objects of one entry of the scene file, by number.
  struct Group {
    std::string name;
    std::uint16_t label = 0;
    std::uint32_t first = 1;
    std::uint32_t count = 0;
  };

  GroundCover cover;  ///< empty if the ground is of one material without an image
  ObjectTracer objects;
  std::vector<ModelTruth> models;
  std::vector<ModelScene> shapes;  ///< what the models show, each once
  Materials materials;             ///< of the ground, if it has one, and then of the models
  std::vector<Group> groups;
  std::string fingerprint;       ///< equal texts mean equal objects and equal cover
  std::size_t memory_bytes = 0;  ///< of all of this, as it is traced
};

/// Loads and builds what a scene names.
/// @param begin  time 0 of the run, on the clock of recorded paths.
/// @throws Error that names the entry, if a file is at fault, an object has no ground under it,
///         drives off it or has a path that misses the run, or a surface has no material but a
///         lidar has light.
Content build_content(const SceneSpec& spec, const Terrain& terrain,
                      std::chrono::nanoseconds begin);

}  // namespace groundray
