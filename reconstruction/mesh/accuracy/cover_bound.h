#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/mesh_arrays.h"

namespace groundray {

/// Upper bound of the distance from a triangle to a mesh that covers it as seen along a direction:
/// tight where both are nearly parallel, however large the distance and the triangles are.
/// Immutable; the mesh must outlive it. Not installed.
class CoverBound {
 public:
  explicit CoverBound(const TriangleMesh& mesh);

  /// Returns an upper bound of the distances, m, from the triangle's points to the mesh. Returns
  /// infinity if the mesh, traversed from `start` and seen along the direction, has a fold, a
  /// boundary or too many triangles before the whole triangle is covered.
  /// @param start      triangle of the mesh near the triangle's centroid.
  double bound_m(const std::array<glm::dvec3, 3>& corners, const glm::dvec3& direction,
                 std::uint32_t start) const;

  /// Returns true if each of the triangle's points has a point of the mesh along the direction that
  /// is no farther than the mesh's triangle there allows. Returns false where bound_m() is
  /// infinite, except that more triangles are permitted.
  /// @param most_m  distance that a triangle of the mesh allows, m.
  bool is_within(const std::array<glm::dvec3, 3>& corners, const glm::dvec3& direction,
                 std::uint32_t start, const std::function<double(std::uint32_t)>& most_m) const;

 private:
  class Walk;

  const TriangleMesh& mesh_;
  double size_m_ = 0;  // largest coordinate of the mesh
  Buckets around_;     // triangles at each vertex
};

}  // namespace groundray
