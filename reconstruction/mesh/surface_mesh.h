#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/manifold_mesh.h"

// Let OpenMesh store positions as the rest of the library does: it takes any type of vector with
// these traits, and functions found by their argument.
namespace glm {
inline double norm(const dvec3& v) noexcept { return length(v); }
}  // namespace glm
template <>
struct OpenMesh::vector_traits<glm::dvec3> {
  using vector_type = glm::dvec3;
  using value_type = double;
  // NOLINTNEXTLINE(readability-identifier-naming): OpenMesh reads it
  static constexpr std::size_t size_ = 3;
  static constexpr std::size_t size() { return size_; }
};

namespace groundray {

/// Traits of SurfaceMesh: positions in double precision, and marks of what was deleted.
struct SurfaceTraits : OpenMesh::DefaultTraits {
  using Point = glm::dvec3;
  using Normal = glm::dvec3;
  VertexAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
};

/// Surface whose edges know their triangles, and whose triangles can change. CGAL's algorithms use
/// it, too, without a copy. Positions, m.
/// @see Botsch, Steinberg, Bischoff, Kobbelt, OpenMesh - a generic and efficient polygon mesh data
///      structure, OpenSG Symposium (2002).
using SurfaceMesh = OpenMesh::TriMesh_ArrayKernelT<SurfaceTraits>;

/// Returns the number of a vertex, half-edge, edge or triangle.
inline std::uint32_t number_of(const OpenMesh::BaseHandle& handle) noexcept {
  return static_cast<std::uint32_t>(handle.idx());
}

/// Returns the vertices of a triangle.
inline glm::uvec3 corners_of(const SurfaceMesh& surface, std::uint32_t triangle) {
  glm::uvec3 corners;
  auto h = surface.halfedge_handle(surface.face_handle(triangle));
  for (int k = 0; k < 3; ++k, h = surface.next_halfedge_handle(h))
    corners[k] = number_of(surface.to_vertex_handle(h));
  return corners;
}

/// Makes a surface of triangles; vertices and triangles keep their numbers. Adding triangle by
/// triangle would reject boundaries that touch at a vertex.
/// @param pairs        of the triangles; none is dropped.
/// @param next_border  returns the boundary half-edge that ends where another begins.
SurfaceMesh to_surface(std::span<const glm::dvec3> points_m, std::span<const glm::uvec3> triangles,
                       const EdgePairs& pairs,
                       const std::function<HalfEdge(HalfEdge)>& next_border);

/// Makes a surface of a manifold's triangles.
SurfaceMesh to_surface(const TriangleMesh& shape, const EdgePairs& pairs);

/// Returns the half-edge of a surface made by to_surface, before it is changed.
SurfaceMesh::HalfedgeHandle handle_of(const SurfaceMesh& surface, HalfEdge h);

/// Vertices and triangles of a surface that were not deleted, in the same order.
struct RemainingMesh {
  TriangleMesh mesh;                   ///< without levels
  std::vector<std::uint32_t> sources;  ///< of each vertex: its number in the surface
  std::vector<std::uint32_t> numbers;  ///< of each vertex of the surface; `none` if it was deleted
};

/// Returns what was not deleted from a surface.
RemainingMesh remaining_mesh(const SurfaceMesh& surface);

}  // namespace groundray
