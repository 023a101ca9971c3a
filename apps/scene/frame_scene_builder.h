#pragma once

#include <glm/vec3.hpp>
#include <optional>

#include "apps/scene/simulation.h"
#include "core/tracing/scene.h"
#include "terrain/lod/clipmap.h"

namespace groundray {

/// Builder of the scenes of frames. The origin of L follows the sensor over its lattice, and the
/// terrain's levels follow the sensor's positions during the frame, so that a frame's result
/// depends on the frame alone.
class FrameSceneBuilder {
 public:
  /// @param simulation  must outlive this.
  explicit FrameSceneBuilder(const Simulation& simulation) : simulation_(simulation) {}

  /// Returns the scene of a frame; valid until the next call.
  /// @throws Error if it needs more memory than the scene file permits.
  const Scene& operator()(const Exposed& frame);

 private:
  void take(RayTracer rays);

  const Simulation& simulation_;
  glm::dvec3 p_DL_{0};
  std::optional<Clipmap> clipmap_;
  std::optional<Scene> scene_;
};

}  // namespace groundray
