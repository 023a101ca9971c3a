#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <span>

namespace groundray {

/// What the triangles round a vertex say of volume: of a place p given from the vertex, each is,
/// with it, six times a tetrahedron's volume large. Their sum is normal * p, that of their squares
/// p * squares * p.
struct VolumeTerm {
  glm::dvec3 normal{0};
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  /// Adds a triangle.
  /// @param n  its normal, twice its area long.
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

/// Where the ends of an edge become one vertex, and what that costs.
struct EdgePlacement {
  glm::dvec3 place_m{0};
  double cost = 0;
};

/// An edge and all round it, places given from the first end.
struct EdgeSurroundings {
  glm::dvec3 edge_m{0};  ///< the second end
  VolumeTerm volume;     ///< of the triangles of either end
  glm::dvec3 pull{0};    ///< `squares * edge_m` of the second end's
  double lift = 0;       ///< `normal * edge_m` of the second end's
  double rest = 0;       ///< `edge_m * pull`
  /// Edges of the border that end at either end, as the surface is to their left: begin and end.
  struct BorderEdge {
    glm::dvec3 begin_m{0}, end_m{0};
  };
  std::span<const BorderEdge> borders;
  std::optional<glm::dvec3> middle_m;  ///< of the vertices round it; for when all else fails
};

/// Returns the place that changes the border's area, the volume, and squares of both least, and of
/// equally good ones that nearest to the middle; none if that is not given but needed. What tells
/// it to a degree at most is left out.
/// @see Lindstrom, Turk, Fast and memory efficient polygonal simplification, IEEE Visualization
///      (1998), sections 3 and 4.
std::optional<EdgePlacement> place_edge(const EdgeSurroundings& edge) noexcept;

}  // namespace groundray
