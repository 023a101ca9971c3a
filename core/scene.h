#pragma once

#include <cstdint>
#include <vector>

#include "core/material.h"
#include "core/ray_tracer.h"

namespace groundray {

/// What the truth says of a surface besides its shape.
struct SurfaceTruth {
  std::uint16_t label = 0;     ///< semantic class; 0 is "none"
  std::uint32_t instance = 0;  ///< 0 is "no object"
  std::uint16_t material = 0;  ///< index among the scene's
};

/// The world as sensors see it: everything that rays can meet, and what is known about it.
/// Immutable once built.
struct Scene {
  RayTracer rays;
  SurfaceTruth terrain;
  std::vector<Material> materials;  ///< none, if no lidar has light
};

}  // namespace groundray
