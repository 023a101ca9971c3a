#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/mesh/simplify/collapsible_mesh.h"
#include "reconstruction/mesh/simplify/decimation_state.h"

namespace groundray {

/// Volume terms of the triangles around a vertex. With a position p relative to the vertex, each
/// triangle spans a tetrahedron; n * p is six times its volume. The sum over the triangles is
/// normal * p, and the sum of squares is p * squares * p.
struct VolumeTerm {
  glm::dvec3 normal{0};
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  /// Adds a triangle.
  /// @param n  its normal, twice the area long.
  void add(const glm::dvec3& n, double times = 1) noexcept {
    normal += times * n;
    xx += times * n.x * n.x, xy += times * n.x * n.y, xz += times * n.x * n.z;
    yy += times * n.y * n.y, yz += times * n.y * n.z, zz += times * n.z * n.z;
  }
  VolumeTerm& operator+=(const VolumeTerm& other) noexcept {
    normal += other.normal;
    xx += other.xx, xy += other.xy, xz += other.xz;
    yy += other.yy, yz += other.yz, zz += other.zz;
    return *this;
  }
  glm::dvec3 times(const glm::dvec3& p) const noexcept {
    return {xx * p.x + xy * p.y + xz * p.z, xy * p.x + yy * p.y + yz * p.z,
            xz * p.x + yz * p.y + zz * p.z};
  }
};

/// Position to which the ends of an edge collapse, and its cost.
struct EdgePlacement {
  glm::dvec3 place_m{0};
  double cost = 0;
};

/// Edge and its neighbourhood; positions are relative to the first end.
struct EdgeSurroundings {
  glm::dvec3 edge_m{0};  ///< position of the second end
  VolumeTerm volume;     ///< of the triangles at either end
  glm::dvec3 pull{0};    ///< `squares * edge_m` of the second end's term
  double lift = 0;       ///< `normal * edge_m` of the second end's term
  double rest = 0;       ///< `edge_m * pull`
  /// Boundary edge at either end, from begin to end with the surface to its left.
  struct BorderEdge {
    glm::dvec3 begin_m{0}, end_m{0};
  };
  std::span<const BorderEdge> borders;
  std::optional<glm::dvec3> middle_m;  ///< mean of the surrounding vertices; the last resort
};

/// Returns the position that least changes the boundary's area, the volume, and the squares of
/// both; of equally good positions the one nearest to `middle_m`, or nothing if that is required
/// but not given. Conditions that differ by at most a degree from earlier ones are omitted.
/// @see Lindstrom, Turk, Fast and memory efficient polygonal simplification, IEEE Visualization
///      (1998), sections 3 and 4.
std::optional<EdgePlacement> place_edge(const EdgeSurroundings& edge) noexcept;

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
