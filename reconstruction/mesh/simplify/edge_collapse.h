#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/mesh/simplify/collapsible_mesh.h"
#include "reconstruction/mesh/simplify/decimation_state.h"

namespace groundray {

/// Weighted sum of squared distances from planes, as a polynomial of position.
/// @see Garland, Heckbert, Surface simplification using quadric error metrics, SIGGRAPH (1997).
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // second-order coefficients
  double x = 0, y = 0, z = 0;                             // half of the first-order coefficients
  double one = 0;                                         // value at the origin

  /// Adds the weighted square of the distance from a plane through the origin.
  /// @param normal  of unit length.
  void add_plane(const glm::dvec3& normal, double weight) noexcept {
    const glm::dvec3 n = weight * normal;
    xx += n.x * normal.x, xy += n.x * normal.y, xz += n.x * normal.z;
    yy += n.y * normal.y, yz += n.y * normal.z, zz += n.z * normal.z;
  }

  Quadric& operator+=(const Quadric& other) noexcept {
    xx += other.xx, xy += other.xy, xz += other.xz;
    yy += other.yy, yz += other.yz, zz += other.zz;
    x += other.x, y += other.y, z += other.z, one += other.one;
    return *this;
  }

  /// Returns the sum of the weights.
  double weight() const noexcept { return xx + yy + zz; }

  /// Returns the sum at a position; rounding may make it slightly negative.
  double at(const glm::dvec3& p) const noexcept {
    return p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z + x)) +
           p.y * (yy * p.y + 2 * (yz * p.z + y)) + p.z * (zz * p.z + 2 * z) + one;
  }

  /// Returns the same sum for positions relative to `origin`.
  Quadric seen_from(const glm::dvec3& origin) const noexcept {
    Quadric moved = *this;
    moved.x += xx * origin.x + xy * origin.y + xz * origin.z;
    moved.y += xy * origin.x + yy * origin.y + yz * origin.z;
    moved.z += xz * origin.x + yz * origin.y + zz * origin.z;
    moved.one = at(origin);
    return moved;
  }
};

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
