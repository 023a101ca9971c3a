#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

#include "core/mesh.h"

namespace groundray {

/// Bounds how far a triangle is from a mesh by what covers it, seen along a direction: tight where
/// both are nearly parallel, however large the distance and the triangles are. Immutable; the mesh
/// must outlive it. Not installed.
class CoverBound {
 public:
  explicit CoverBound(const TriangleMesh& mesh);

  /// Returns a bound of the distances of a triangle's points from the mesh; infinity where that,
  /// seen along the direction from `start` on, has a fold, a border or too many triangles before
  /// all is covered.
  /// @param start      triangle of the mesh near the middle.
  double bound_m(const std::array<glm::dvec3, 3>& corners, const glm::dvec3& direction,
                 std::uint32_t start) const;

  /// Whether each of a triangle's points has one of the mesh along the direction that is no farther
  /// than the triangle there allows. Not so, either, where `bound_m` is infinite, but for more
  /// triangles.
  /// @param most_m  what a triangle of the mesh allows, metres.
  bool is_within(const std::array<glm::dvec3, 3>& corners, const glm::dvec3& direction,
                 std::uint32_t start, const std::function<double(std::uint32_t)>& most_m) const;

 private:
  class Walk;

  const TriangleMesh& mesh_;
  double size_m_ = 0;                  // of the mesh's coordinates
  std::vector<std::uint32_t> begins_;  // of each vertex, in `around_`, and the end
  std::vector<std::uint32_t> around_;  // triangles that have it
};

}  // namespace groundray
