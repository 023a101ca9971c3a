#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "reconstruction/mesh/simplify/collapse_queue.h"
#include "reconstruction/mesh/simplify/decimation_state.h"
#include "reconstruction/mesh/simplify/quadric.h"

namespace groundray {

/// Collapses edges one by one, each time the cheapest that the rules allow. The cost is the sum of
/// squared distances from the planes of triangles, weighted by their areas, times the total area,
/// so that vertices which already represent a large area are spared. Costs are updated only when
/// the surface changes next to the vertex that would leave. The target vertex may have absorbed
/// others since then, which the order ignores; to account for it would change the number of
/// triangles left by about one percent at most, and take longer. A rejected collapse is tried again
/// only after the surface has changed next to that vertex.
class EdgeCollapse {
 public:
  /// @param line_weight  weight of planes through the edges of lines, perpendicular to the surface,
  ///                     relative to the squares of the edges' lengths.
  EdgeCollapse(DecimationState& piece, CollapseRules& rules, double line_weight);

  /// Collapses an edge. Returns false if none was left to collapse.
  bool step();
  /// Returns the cost of the latest collapse.
  double cost() const noexcept { return cost_; }
  /// Returns the mean squared distance of the latest collapse, m^2.
  double mean_square_m2() const noexcept { return cost_ / (weight_ * weight_); }
  /// Returns the approximate fraction of the work that is done, from the length of the queue.
  double share() const noexcept;

 private:
  void add_triangles();
  void add_lines(double weight);
  void inherit(std::uint32_t vertex, std::uint32_t from);
  void enter(std::uint32_t vertex);
  void enter(const Star& star, const FeatureLines::Crossing& crossing);

  DecimationState& piece_;
  CollapseRules& rules_;
  // Value of a vertex's quadric at the vertex, and its weight: all that its neighbours require.
  struct Own {
    double squares = 0;
    double weight = 0;
  };

  std::vector<Quadric> quadrics_;       // of each vertex, for positions relative to it
  std::vector<Own> own_;                // of each vertex
  std::vector<std::uint64_t> refused_;  // of each vertex: bit set of rejected targets in the ring
  std::vector<std::uint8_t> targets_;   // of each queued vertex: its target in the ring
  CollapseQueue queue_;
  std::size_t most_queued_ = 0;
  double cost_ = 0, weight_ = 1;
  Star star_, other_;
};

}  // namespace groundray
