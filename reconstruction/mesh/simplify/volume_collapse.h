#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "reconstruction/mesh/simplify/bounds/shape_rules.h"
#include "reconstruction/mesh/simplify/collapse_queue.h"
#include "reconstruction/mesh/simplify/collapsible_mesh.h"
#include "reconstruction/mesh/simplify/edge_placement.h"

namespace groundray {

/// Collapses edges one by one, each time the one that changes volume and boundary least, to the
/// position that does so. No triangle is flipped, and none overhangs if none did before.
class VolumeCollapse {
 public:
  /// Treatment of overhangs, and distance of the final positions from the world's origin: triangles
  /// must face up after rounding there.
  struct Lie {
    Overhang overhang = Overhang::Allow;
    double away_m = 0;
  };
  /// @param mesh      must outlive this.
  /// @param places_m  of each vertex, m; modified. Must outlive this.
  /// @param tell      progress callback: receives the fraction of edges evaluated.
  VolumeCollapse(CollapsibleMesh& mesh, std::vector<glm::dvec3>& places_m, const Lie& lie,
                 const std::function<void(double share)>& tell);

  /// Vertex that was merged into another.
  struct Merge {
    std::uint32_t gone = 0, kept = 0;
  };
  /// Collapses an edge; returns nothing if no permitted collapse is left.
  std::optional<Merge> step();
  /// Returns the number of evaluations of edges, to which the time is proportional.
  std::uint64_t looked_at() const noexcept { return looked_at_; }

 private:
  using BorderEdge = EdgeSurroundings::BorderEdge;

  HalfEdge edge_of(HalfEdge h) const noexcept;
  glm::dvec3 normal(std::uint32_t triangle) const noexcept;
  void sum_up(std::uint32_t vertex);
  void add_borders(std::uint32_t vertex, const glm::dvec3& origin_m);
  void note_ring(const Star& star);
  glm::dvec3 middle_round(HalfEdge h) const noexcept;
  std::optional<EdgePlacement> placement(HalfEdge h);
  void enter(HalfEdge h);
  bool choose_centre(HalfEdge h);
  bool is_legal(const glm::dvec3& place_m) const;
  bool keeps_sides(const Star& star, std::uint32_t other, const glm::dvec3& place_m) const;
  void collapse(const glm::dvec3& place_m);
  void enter_round(std::uint32_t vertex);

  CollapsibleMesh& mesh_;
  std::vector<glm::dvec3>& places_m_;
  Lie lie_;
  std::vector<VolumeTerm> terms_;  // of each vertex
  /// Neighbours of a vertex: their number, the sum of their positions relative to it, and, at the
  /// boundary, the first and the last.
  struct Ring {
    glm::dvec3 sum_m{0};
    std::uint32_t count = 0;
    std::uint32_t first = none, last = none;
  };
  std::vector<Ring> rings_;             // of each vertex
  std::vector<bool> is_border_;         // of each vertex
  std::vector<std::uint32_t> changed_;  // of each vertex: the latest collapse next to it
  std::uint32_t collapses_ = 0;
  std::uint64_t looked_at_ = 0;
  CollapseQueue queue_;

  // For the edge being evaluated:
  Star star_, other_, round_;
  std::size_t to_ = 0;
  std::vector<BorderEdge> borders_;
};

}  // namespace groundray
