#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/mesh.h"

namespace groundray {

/// Mesh whose vertices were measured. Each attribute has one value per vertex, or none at all.
struct MeasuredMesh {
  TriangleMesh shape;
  std::vector<float> sd_m;            ///< standard deviation of each vertex along its line of sight
  std::vector<std::uint16_t> labels;  ///< semantic class of each vertex; 0 is "none"
  std::vector<float> confidence;  ///< per vertex, 0 to 1: highest at normal incidence, see link()
};

}  // namespace groundray
