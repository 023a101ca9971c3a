#pragma once

// clang-format off
#include <OpenMesh/Core/Utils/vector_traits.hh>
#include <OpenMesh/Core/Geometry/QuadricT.hh>  // needs the traits, but does not include them
// clang-format on
#include <OpenMesh/Tools/Utils/HeapT.hh>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "reconstruction/mesh/simplify/decimation_state.h"

namespace groundray {

/// Costs of vertices' cheapest collapses, by which OpenMesh's heap orders vertices: of equal costs,
/// the lowest number comes first.
class CollapseCosts {
 public:
  explicit CollapseCosts(std::size_t vertices) : costs_(vertices), places_(vertices, -1) {}

  double& operator[](std::uint32_t vertex) noexcept { return costs_[vertex]; }
  bool less(std::uint32_t a, std::uint32_t b) const noexcept {
    return costs_[a] != costs_[b] ? costs_[a] < costs_[b] : a < b;
  }
  bool greater(std::uint32_t a, std::uint32_t b) const noexcept { return less(b, a); }
  int get_heap_position(std::uint32_t vertex) const noexcept { return places_[vertex]; }
  void set_heap_position(std::uint32_t vertex, int place) noexcept { places_[vertex] = place; }

 private:
  std::vector<double> costs_;
  std::vector<int> places_;  // in the heap, or -1
};

/// Collapses edges one by one, each time the cheapest that the rules allow. The cost is the sum of
/// squared distances from the planes of triangles, weighted by their areas, times the total area,
/// so that vertices which already represent a large area are spared. A rejected collapse is tried
/// again only after the surface has changed next to the vertex that would leave.
///
/// Costs are updated lazily: a vertex whose neighbourhood has changed is evaluated again when it
/// comes first in the queue, so one whose cost has fallen is collapsed late. This changes the
/// number of triangles left by about one percent at most.
///
/// OpenMesh's DecimaterT, which calls every rule for each edge whose cost may have changed, would
/// make 22 times as many proofs (fractal of 513 x 513 vertices, vertical bounds).
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
  void add_plane(std::uint32_t vertex, const glm::dvec3& normal, double weight);
  void inherit(std::uint32_t vertex, std::uint32_t from);
  void enter(std::uint32_t vertex);
  void enter(const Star& star, const FeatureLines::Crossing& crossing);
  void queue(std::uint32_t vertex, double cost);

  DecimationState& piece_;
  CollapseRules& rules_;
  // Position of a vertex, value of its quadric there, and its weight: all that its neighbours
  // require, in one place.
  struct Own {
    glm::dvec3 p_m{0};
    double squares = 0;
    double weight = 0;
  };

  using Quadric = OpenMesh::Geometry::Quadricd;

  std::vector<Quadric> quadrics_;       // of each vertex, for positions relative to it
  std::vector<Own> own_;                // of each vertex
  std::vector<std::uint64_t> refused_;  // of each vertex: bit set of rejected targets in the ring
  std::vector<std::uint8_t> targets_;   // of each queued vertex: its target in the ring
  std::vector<bool> is_outdated_;       // of each queued vertex: its ring has changed
  OpenMesh::Utils::HeapT<std::uint32_t, CollapseCosts> queue_;
  std::size_t most_queued_ = 0;
  double cost_ = 0, weight_ = 1;
  Star star_, other_;
};

/// Cost of a collapse, and the number of triangles left.
struct CostStep {
  double cost = 0;
  std::size_t triangles = 0;
};

/// Returns the number of triangles at the knee of the cost: see CostKnee. Uses the running maximum
/// of the cost.
/// @param steps  of a run to the end, in order; the first precedes all collapses.
std::size_t find_knee(const std::vector<CostStep>& steps);

}  // namespace groundray
