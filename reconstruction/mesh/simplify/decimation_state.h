#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/mesh/simplify/collapsible_mesh.h"
#include "reconstruction/mesh/simplify/feature_lines.h"

namespace groundray {

/// Vertex of the original: its position and, once collapsed, the list that it belongs to.
struct Sample {
  glm::dvec3 p_m{0};
  std::uint32_t next = none;  ///< next vertex collapsed into the same triangle
  float tolerance_m = 0;      ///< permitted distance of the surface
};

/// Mesh that is being simplified. Its vertices do not move: one is removed when an edge collapses
/// onto its other end.
struct DecimationState {
  CollapsibleMesh mesh;
  FeatureLines lines;
  std::vector<Sample> samples;  ///< of each vertex
};

/// Rules that decide which collapses are permitted. Collapses are tested and made one at a time.
class CollapseRules {
 public:
  CollapseRules() = default;
  CollapseRules(const CollapseRules&) = delete;
  CollapseRules& operator=(const CollapseRules&) = delete;
  virtual ~CollapseRules() = default;

  /// Returns true if the star's centre may move onto ring[to], which lines and labels allow.
  virtual bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) = 0;
  /// Records the collapse, right after it was allowed and before the mesh and its lines change.
  virtual void collapse(const Star& star, const FeatureLines::Crossing& crossing,
                        std::size_t to) = 0;
};

}  // namespace groundray
