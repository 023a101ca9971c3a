#pragma once

#include <cstdint>

#include "core/ray_tracer.h"

namespace groundray {

/// What the truth says of a surface besides its shape.
struct SurfaceTruth {
  std::uint16_t label = 0;     ///< semantic class; 0 is "none"
  std::uint32_t instance = 0;  ///< 0 is "no object"
};

/// The world as sensors see it: everything that rays can meet, and what is known about it.
/// Immutable once built.
struct Scene {
  RayTracer rays;
  SurfaceTruth terrain;
};

}  // namespace groundray
