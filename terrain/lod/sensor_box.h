#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "core/geometry/grid_frame.h"
#include "terrain/lod/quadtree.h"

namespace groundray {

/// Bounding box of the positions of a frame's sensors, in D. Its centre is the viewpoint.
struct SensorBox {
  glm::dvec3 low_m{0}, high_m{0};
};

/// Returns the bound of a mesh that is seen from `sensors`, in the coordinates of its grid.
inline MeshBound bound_from(const SensorBox& sensors, const GridFrame& frame, double tolerance_m,
                            double angle_rad) {
  const glm::dvec2 cell_m = glm::abs(frame.step_m);
  const glm::dvec2 a = frame.to_grid(glm::dvec2(sensors.low_m)) * cell_m;
  const glm::dvec2 b = frame.to_grid(glm::dvec2(sensors.high_m)) * cell_m;
  return {.tolerance_m = tolerance_m,
          .angle_rad = angle_rad,
          .low_m = {glm::min(a, b), sensors.low_m.z},
          .high_m = {glm::max(a, b), sensors.high_m.z},
          .cell_m = cell_m};
}

}  // namespace groundray
