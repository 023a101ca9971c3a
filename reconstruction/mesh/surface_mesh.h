#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/measured_mesh.h"
#include "reconstruction/mesh/mesh_arrays.h"

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

/// Traits of SurfaceMesh: positions in double precision, the vertices' sources, and marks of what
/// was deleted.
struct SurfaceTraits : OpenMesh::DefaultTraits {
  using Point = glm::dvec3;
  using Normal = glm::dvec3;
  VertexAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
  VertexTraits {
    /// Number of the vertex in the mesh that the surface was made of; `none` if it was added since.
    std::uint32_t source = none;
  };
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

/// Returns the number of a vertex in the mesh that the surface was made of.
inline std::uint32_t source_of(const SurfaceMesh& surface, SurfaceMesh::VertexHandle vertex) {
  return surface.data(vertex).source;
}

/// Returns the half-edge of a triangle from its corner `k` to the next.
inline SurfaceMesh::HalfedgeHandle half_edge_of(const SurfaceMesh& surface, std::uint32_t triangle,
                                                int k) {
  auto h = surface.next_halfedge_handle(
      surface.halfedge_handle(SurfaceMesh::FaceHandle(static_cast<int>(triangle))));
  for (; k > 0; --k) h = surface.next_halfedge_handle(h);
  return h;
}

/// Returns the triangle on the other side of a half-edge; `none` at a boundary.
inline std::uint32_t triangle_across(const SurfaceMesh& surface, SurfaceMesh::HalfedgeHandle h) {
  return number_of(surface.opposite_face_handle(h));  // the invalid handle is -1
}

/// Returns the vertices of a triangle.
inline glm::uvec3 corners_of(const SurfaceMesh& surface, std::uint32_t triangle) {
  glm::uvec3 corners;
  auto h = surface.halfedge_handle(SurfaceMesh::FaceHandle(static_cast<int>(triangle)));
  for (int k = 0; k < 3; ++k, h = surface.next_halfedge_handle(h))
    corners[k] = number_of(surface.to_vertex_handle(h));
  return corners;
}

/// Limit of the number of triangles: 2^31 half-edges if none are joined.
inline constexpr std::size_t most_triangles = 350'000'000;

/// Returns true if a triangle has a vertex twice.
inline bool repeats_vertex(const glm::uvec3& t) noexcept {
  return t.x == t.y || t.y == t.z || t.z == t.x;
}

/// Returns for each triangle whether it repeats a vertex, or an earlier triangle with the same
/// winding.
/// @param vertices  number of vertices.
std::vector<bool> find_repeats(std::span<const glm::uvec3> triangles, std::size_t vertices);

/// Makes a surface of any triangles; vertices and triangles keep their numbers. An edge of two
/// triangles that traverse it in opposite directions joins them. An edge of more, or of two in the
/// same direction, is a boundary of each; its half-edges in triangles are tagged. Triangles found
/// by find_repeats are tagged and joined to nothing. Each of several fans at a vertex has
/// boundaries of its own.
/// @throws Error if there are `most_triangles` or more.
SurfaceMesh to_surface(std::span<const glm::dvec3> points_m, std::span<const glm::uvec3> triangles);
inline SurfaceMesh to_surface(const TriangleMesh& mesh) {
  return to_surface(mesh.vertices_m, mesh.triangles);
}

/// Makes a surface of a measured mesh. The standard deviations, labels and confidences that the
/// mesh has become properties of the vertices.
SurfaceMesh to_surface(const MeasuredMesh& mesh);

/// Vertices and triangles of a surface that were not deleted, in the same order.
struct RemainingMesh {
  TriangleMesh mesh;                   ///< without levels
  std::vector<std::uint32_t> sources;  ///< of each vertex, as source_of
  std::vector<std::uint32_t> numbers;  ///< of each vertex of the surface; `none` if it was deleted
};

/// Returns what was not deleted from a surface.
RemainingMesh remaining_mesh(const SurfaceMesh& surface);

/// Returns what was not deleted from a surface made of a measured mesh, with its attributes.
MeasuredMesh remaining_measured_mesh(const SurfaceMesh& surface);

}  // namespace groundray
