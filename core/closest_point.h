#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>

#include "core/mesh.h"
#include "core/ray_tracer.h"

namespace groundray {

/// Returns the vector from `p` to the nearest point of the triangle a, b, c, which may be a needle
/// or a point. Its length is right, and its end on the triangle, to 16 ulp of the largest distance
/// between the four.
glm::dvec3 vector_to_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                              const glm::dvec3& c) noexcept;

/// Where a mesh is nearest to a point.
struct NearestPoint {
  double distance_m = 0;
  glm::dvec3 point{0};         ///< on the mesh, in its frame
  std::uint32_t triangle = 0;  ///< that has it
};

/// Finds the nearest point of a mesh. Immutable; copies share it, and any number of threads may ask
/// at once. Embree's floats only say which triangles to look at, rounded so that the nearest is
/// always among them: distances are those that double arithmetic gives over all triangles.
class ClosestPoint {
 public:
  /// @throws Error naming every fault of the mesh, as check_mesh; or if Embree lacks memory.
  explicit ClosestPoint(TriangleMesh mesh, const RayDevice& device = RayDevice());

  /// Returns the nearest point to `p`; where triangles are equally far, that of the first.
  /// @param p     finite, in the mesh's frame.
  /// @param near  a triangle: the nearer it is the less is looked at. For speed alone: the answer
  ///              does not depend on it.
  NearestPoint nearest(const glm::dvec3& p, std::uint32_t near = 0) const noexcept;

  /// Returns how far `p` is from one triangle, metres, as `nearest` measures it.
  double distance_m(const glm::dvec3& p, std::uint32_t triangle) const noexcept;

  const TriangleMesh& mesh() const noexcept;

  struct Impl;

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace groundray
