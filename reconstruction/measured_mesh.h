#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh.h"

namespace groundray {

/// A mesh whose vertices were measured. What is known of each vertex is one value for each, or
/// none for all.
struct MeasuredMesh {
  TriangleMesh shape;
  std::vector<float> sd_m;            ///< standard deviation of each vertex along its line of sight
  std::vector<std::uint16_t> labels;  ///< semantic class of each vertex; 0 is "none"
  std::vector<float> confidence;      ///< of each vertex, 0 to 1: how squarely it was seen
};

}  // namespace groundray
