#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "reconstruction/simplify/collapse_queue.h"
#include "reconstruction/simplify/quadric.h"
#include "reconstruction/simplify/workpiece.h"

namespace groundray {

/// Collapses edges one by one, each time the cheapest that the rules allow: what one costs is the
/// sum of squares of distances from the planes of triangles, by their area, times this area: what
/// stands for much already is spared. It is that of when the surface last changed beside the vertex
/// that is to leave: what this may move onto can have taken in more since, from farther off, which
/// the order does not know. If it did, about a percent more or fewer triangles would be left, at
/// most, and it would take longer. A collapse that they do not allow is tried again only after the
/// surface changed beside that vertex.
class EdgeCollapse {
 public:
  /// @param line_weight  of planes through the edges of lines, upright on the surface, by the
  ///                     squares of their lengths.
  EdgeCollapse(Workpiece& piece, CollapseRules& rules, double line_weight);

  /// Collapses an edge. Returns whether any was left to collapse.
  bool step();
  /// Returns what the latest collapse cost.
  double cost() const noexcept { return cost_; }
  /// Returns the mean square of the distances of what it cost.
  double mean_square_m2() const noexcept { return cost_ / (weight_ * weight_); }
  /// Returns about which share of the work is done: how much of the queue went.
  double share() const noexcept;

 private:
  void add_triangles();
  void add_lines(double weight);
  void inherit(std::uint32_t vertex, std::uint32_t from);
  void enter(std::uint32_t vertex);
  void enter(const Star& star, const FeatureLines::Crossing& crossing);

  Workpiece& piece_;
  CollapseRules& rules_;
  // What a vertex' quadric has where the vertex is: all that its neighbours ask of it.
  struct Own {
    double squares = 0;
    double weight = 0;
  };

  std::vector<Quadric> quadrics_;       // of each vertex, for places given from it
  std::vector<Own> own_;                // of each vertex
  std::vector<std::uint64_t> refused_;  // of each vertex: onto which of the ring it may not
  std::vector<std::uint8_t> targets_;   // of each vertex in the queue: which of the ring
  CollapseQueue queue_;
  std::size_t most_queued_ = 0;
  double cost_ = 0, weight_ = 1;
  Star star_, other_;
};

}  // namespace groundray
