#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>

#include "core/geometry/mesh.h"
#include "core/tracing/ray_tracer.h"

namespace groundray {

/// Returns the vector from `p` to the nearest point of the triangle a, b, c, which may be
/// degenerate (a segment or a point). Its length is accurate, and its end lies on the triangle, to
/// 16 ulp of the largest distance between the four points.
glm::dvec3 vector_to_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                              const glm::dvec3& c) noexcept;

/// Nearest point of a mesh.
struct NearestPoint {
  double distance_m = 0;
  glm::dvec3 point{0};         ///< on the mesh, in its frame
  std::uint32_t triangle = 0;  ///< index of the triangle that contains `point`
};

/// Finds the nearest point of a mesh. Immutable; copies share the mesh, and any number of threads
/// may query at once. Embree's floats only preselect triangles, with bounds that always include the
/// nearest: distances equal those of double arithmetic over all triangles.
class ClosestPoint {
 public:
  /// @throws Error listing every fault of the mesh, as check_mesh; or if Embree runs out of memory.
  explicit ClosestPoint(TriangleMesh mesh, const RayDevice& device = RayDevice());

  /// Returns the point nearest to `p`; of triangles at the same distance, the first counts.
  /// @param p     finite, in the mesh's frame.
  /// @param near  index of a triangle, ideally close to `p`: the closer it is, the smaller the
  ///              search. It affects speed only, not the result.
  NearestPoint nearest(const glm::dvec3& p, std::uint32_t near = 0) const noexcept;

  /// Returns the distance of `p` from one triangle, metres, computed as in `nearest`.
  double distance_m(const glm::dvec3& p, std::uint32_t triangle) const noexcept;

  const TriangleMesh& mesh() const noexcept;

  struct Impl;

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace groundray
