#pragma once

#include "core/tracing/level_surface.h"

namespace groundray {

/// Double-precision data of a packet in exact tracing, by lane: read and written by callbacks.
struct ExactQuery {
  QueryContext context;  ///< first, so that Embree's pointer to it is a pointer to this
  const LevelSurface* surface;
  const LevelRay* rays;
  Crossing* crossings;
};

}  // namespace groundray
