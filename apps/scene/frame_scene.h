#pragma once

#include <glm/vec3.hpp>
#include <optional>

#include "apps/scene/world.h"
#include "core/scene.h"
#include "terrain/clipmap.h"

namespace groundray {

/// Makes scenes as frames ask for them: the float frame L follows the sensor over its lattice, the
/// levels of the terrain follow its positions during the frame, so that what a frame sees depends
/// on the frame alone.
class FrameScene {
 public:
  /// @param world  is to outlive this.
  explicit FrameScene(const World& world) : world_(world) {}

  /// Returns what a frame sees; valid until the next call.
  /// @throws Error if that takes more memory than the scene allows.
  const Scene& operator()(const Exposed& frame);

 private:
  void take(RayTracer rays);

  const World& world_;
  glm::dvec3 p_DL_{0};
  std::optional<Clipmap> clipmap_;
  std::optional<Scene> scene_;
};

}  // namespace groundray
