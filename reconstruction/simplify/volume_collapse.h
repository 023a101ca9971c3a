#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "reconstruction/simplify/collapse_queue.h"
#include "reconstruction/simplify/collapsible_mesh.h"
#include "reconstruction/simplify/edge_placement.h"
#include "reconstruction/simplify/shape_rules.h"

namespace groundray {

/// Collapses edges one by one, each time the one that changes volume and border least, to the place
/// that does. No triangle turns over; nor does one that hung over nowhere where none did.
class VolumeCollapse {
 public:
  /// Whether triangles may hang over, and how far from the world's origin they will be: what lies
  /// flat must do so when its places are rounded there.
  struct Lie {
    Overhang overhang = Overhang::Allow;
    double away_m = 0;
  };
  /// @param mesh      must outlive this.
  /// @param places_m  of each vertex: they move; must outlive this.
  /// @param tell      called now and then with the share of edges that were looked at.
  VolumeCollapse(CollapsibleMesh& mesh, std::vector<glm::dvec3>& places_m, const Lie& lie,
                 const std::function<void(double share)>& tell);

  /// A vertex that went into another.
  struct Merge {
    std::uint32_t gone = 0, kept = 0;
  };
  /// Collapses an edge; none if none is left that may.
  std::optional<Merge> step();
  /// Returns how often an edge was looked at: time goes with it.
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
  /// Neighbours of a vertex: how many, the sum of where they are from it, and of a vertex on the
  /// border the first and the last.
  struct Ring {
    glm::dvec3 sum_m{0};
    std::uint32_t count = 0;
    std::uint32_t first = none, last = none;
  };
  std::vector<Ring> rings_;             // of each vertex
  std::vector<bool> is_border_;         // of each vertex
  std::vector<std::uint32_t> changed_;  // of each vertex: the latest collapse beside it
  std::uint32_t collapses_ = 0;
  std::uint64_t looked_at_ = 0;
  CollapseQueue queue_;

  // Of the edge that is looked at:
  Star star_, other_, round_;
  std::size_t to_ = 0;
  std::vector<BorderEdge> borders_;
};

}  // namespace groundray
