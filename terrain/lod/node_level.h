#pragma once

#include <glm/vec2.hpp>
#include <vector>

namespace groundray {

/// Certified values of the nodes of one level, row by row (see Lattice). Deviations are largest
/// vertical distances from the reference surface in metres, computed in double and rounded up.
struct NodeLevel {
  glm::ivec2 size{0};
  /// Saturated key: the largest deviation of the node and of all nodes below it. Infinite for a
  /// node with holes, negative for one without any height.
  std::vector<float> key_m;
  /// Largest deviation over all templates of the node that its neighbours can require, i.e. with
  /// any of its sides thinned for a coarser neighbour (16, fewer at the DEM's boundary). For a node
  /// with holes, only where both surfaces exist; a sample or an edge of the DEM without a facet
  /// counts as surface.
  std::vector<float> deviation_m;
  /// Deviation of the node with no side thinned; 0 at level 0.
  std::vector<float> full_m;
  /// Lowest and highest sample of the DEM in the node, metres; +inf and -inf if there is none.
  std::vector<float> low_m, high_m;
};

}  // namespace groundray
