#pragma once

#include "core/surface.h"

namespace groundray {

/// The double side of a packet: what exact tracing reads and fills, by lane.
struct ExactQuery {
  QueryContext context;  ///< first, so that Embree's pointer to it is a pointer to this
  const Surface* surface;
  const LevelRay* rays;
  Crossing* crossings;
};

}  // namespace groundray
