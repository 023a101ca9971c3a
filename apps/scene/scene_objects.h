#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/scene/scene_spec.h"
#include "core/tracing/scene.h"
#include "terrain/terrain.h"

namespace groundray {

/// Objects and ground cover of a scene, built for tracing.
struct SceneObjects {
  /// Objects of one entry of the scene file, with consecutive instance numbers from `first`.
  struct Group {
    std::string name;
    std::uint16_t label = 0;
    std::uint32_t first = 1;
    std::uint32_t count = 0;
  };

  GroundCover cover;  ///< empty if the ground has a single material without an image
  ObjectTracer objects;
  std::vector<ModelTruth> models;
  std::vector<ModelScene> shapes;  ///< distinct shapes of the models
  Materials materials;             ///< materials of the ground, if it has any, then of the models
  std::vector<Group> groups;
  std::string fingerprint;       ///< equal texts imply equal objects and equal cover
  std::size_t memory_bytes = 0;  ///< memory of all this, in the form that is traced
};

/// Loads and builds the objects and the ground cover of a scene.
/// @param begin  time 0 of the run, on the clock of recorded paths.
/// @throws Error naming the entry if a file is invalid; if an object has no ground under it, drives
///         off it or has a path that misses the run; or if a surface has no material, but there are
///         cameras or lidars with light.
SceneObjects build_scene_objects(const SceneSpec& spec, const Terrain& terrain,
                                 std::chrono::nanoseconds begin);

}  // namespace groundray
