#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/simplify/collapsible_mesh.h"
#include "reconstruction/simplify/feature_lines.h"

namespace groundray {

/// A vertex of the original: where it is and, once it left, what stands for it.
struct Sample {
  glm::dvec3 p_m{0};
  std::uint32_t next = none;  ///< that left for the same triangle
  float tolerance_m = 0;      ///< how far the surface may be from it
};

/// A mesh that is being simplified. Its vertices do not move: one leaves when an edge collapses
/// onto its other end.
struct Workpiece {
  CollapsibleMesh mesh;
  FeatureLines lines;
  std::vector<Sample> samples;  ///< of each vertex
};

/// Decides which collapses are legal. Each is asked about, and done, in turn.
class CollapseRules {
 public:
  CollapseRules() = default;
  CollapseRules(const CollapseRules&) = delete;
  CollapseRules& operator=(const CollapseRules&) = delete;
  virtual ~CollapseRules() = default;

  /// Whether the star's centre may move onto ring[to], which lines and labels allow.
  virtual bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) = 0;
  /// Notes that it does so, right after it was allowed and before the mesh and its lines change.
  virtual void collapse(const Star& star, const FeatureLines::Crossing& crossing,
                        std::size_t to) = 0;
};

}  // namespace groundray
