#pragma once

#include <cstddef>
#include <glm/vec3.hpp>

#include "core/model/polygon_soup.h"

/// Ends the program unless the model of a file's polygons has valid indices alone.
inline void check_model(const groundray::PolygonSoup& soup) {
  groundray::ModelFaults faults;
  const groundray::Model model = groundray::model_of(soup, faults);
  const std::size_t vertices = model.mesh.vertices_m.size();
  for (const glm::uvec3& t : model.mesh.triangles)
    if (t.x >= vertices || t.y >= vertices || t.z >= vertices) __builtin_trap();
}
