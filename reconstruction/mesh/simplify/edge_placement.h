#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <span>

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

}  // namespace groundray
